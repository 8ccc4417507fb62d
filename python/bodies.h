// SPDX-License-Identifier: MIT
#pragma once

#include "conversions.h"
#include "guarded.h"

#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>

#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>

namespace terrane::python {

namespace py = pybind11;

/// A shape, as held by Python. Immutable.
struct HeldShape {
    Shape shape;
};

/// Adds Shape.
void bind_shapes(py::module_& module);
/// Adds batches of contacts, distances and casts to Ground.
void bind_ground_queries(py::module_& module);
/// Adds batches of queries of two shapes.
void bind_pairs(py::module_& module);

/// A world, as held by Python.
using HeldWorld = Guarded<World>;
using WorldClass = py::class_<HeldWorld, std::shared_ptr<HeldWorld>>;

/// A body's number in Python: generation in the upper 32 bits, index in the lower ones.
constexpr std::uint64_t number_of(BodyId body) {
    return std::uint64_t{body.generation} << 32 | body.index;
}
constexpr BodyId body_of(std::uint64_t number) {
    return {static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(number >> 32)};
}
/// The number that stands for no body.
inline constexpr std::uint64_t kNoBody = number_of(BodyId{});

/// The BodyCondition of a state.
inline py::object condition_of(const BodyState& state) {
    return make_answer("BodyCondition", static_cast<int>(state.condition));
}

/// Adds World and NO_BODY.
void bind_world(py::module_& module);
/// Adds Lidar and lidar_grid().
void bind_lidar(py::module_& module);
/// Methods of World: adding and changing bodies; rays and contact events.
void bind_bodies(WorldClass& world);
void bind_world_queries(WorldClass& world);
/// Adds VehicleSettings, its presets, PathDriver, and vehicles and characters to World.
void bind_vehicles(py::module_& module);

}  // namespace terrane::python
