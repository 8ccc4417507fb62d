// SPDX-License-Identifier: MIT
#pragma once

#include "scene/scene_objects.h"
#include "world/placed_body.h"

#include <terrane/terrain/height_source.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

namespace terrane::tools {

/// The static objects of a scene in a world of bodies, as their collision proxies. Those of scatters are there only
/// near dynamic bodies.
class ObjectBodies {
public:
    /// @param source  ground that scattered objects stand on, volumes included: where they replace it is no object
    /// @param objects of the scene; null: none
    ///
    /// Fails: as make_mesh_body() of a mesh with static objects, and Scatter::create()
    static Result<ObjectBodies> create(std::shared_ptr<const HeightSource> source,
                                       const SceneObjects* objects);

    /// The objects that are placed one by one.
    std::span<const PlacedBody> placed() const { return placed_; }

    /// Call before each step: adds the scattered objects near dynamic bodies, and removes those that are far from all.
    /// An object that would overlap a dynamic body is left out as long as it would. Which objects are in the world
    /// depends on the world's state only: a world that was saved and loaded goes on with the same.
    ///
    /// Fails: as Scatter::objects_in() and World::add()
    /// Cost:  O(bodies); where a body has moved by some metres, also O(objects near bodies)
    Result<void> follow(World& world, const Ground& ground);

private:
    struct StaticScatter {
        Scatter scatter;
        Compound shape;       // at scale 1
        double radius = 0.0;  // of the largest object, about its origin, metres
        std::map<ScatterSquare, std::vector<ScatterPoint>> squares = {};  // near bodies
    };
    // A scattered object: of which scatter, in which square, in which place.
    struct Key {
        std::size_t scatter = 0;
        ScatterSquare square;
        std::size_t index = 0;
        friend constexpr auto operator<=>(const Key&, const Key&) = default;
    };
    // The cube of space that a body is in, and a bound of how far it may get.
    struct Surroundings {
        std::array<std::int64_t, 3> cube{};
        double reach = 0.0;  // metres from the middle of the cube
        friend constexpr auto operator<=>(const Surroundings&, const Surroundings&) = default;
    };

    static std::vector<Surroundings> surroundings_of(const World& world);
    Result<std::set<Key>> find_near(std::span<const Surroundings> around);
    Result<std::optional<BodyId>> add(const Key& key, World& world, const Ground& ground);

    std::vector<PlacedBody> placed_;
    std::vector<std::unique_ptr<StaticScatter>> scatters_;
    std::vector<Surroundings> around_;           // when the objects were chosen; sorted
    std::map<Key, std::optional<BodyId>> near_;  // none: left out
    bool has_followed_ = false;
    // Scattered objects of a world that was loaded, by position, until the first follow() takes them.
    std::map<std::array<double, 3>, BodyId> loaded_;
};

}  // namespace terrane::tools
