// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

// Rough grounds and shapes for worlds of bodies.
namespace terrane::test {

inline constexpr double kStep = 1.0 / 60.0;  // seconds
inline constexpr double kGravity = 9.81;     // m/s^2, of a world's default settings
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Heights by lattice point, for grounds that are not smooth functions.
inline std::uint64_t scramble(double x, double y) {
    std::uint64_t z =
        static_cast<std::uint64_t>(static_cast<std::int64_t>(x)) * 0x9e3779b97f4a7c15u ^
        static_cast<std::uint64_t>(static_cast<std::int64_t>(y)) * 0xc2b2ae3d27d4eb4fu;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    return z ^ (z >> 27);
}

struct RoughGround {
    const char* name;
    double (*height)(double, double);
};

inline constexpr RoughGround kRoughGrounds[] = {
    {"hills",
     [](double x, double y) { return 6.0 * std::sin(0.21 * x) * std::sin(0.17 * y) + 0.3 * x; }},
    {"noise", [](double x, double y) { return static_cast<double>(scramble(x, y) % 256) / 64.0; }},
    {"spikes", [](double x, double y) { return scramble(x, y) % 7 == 0 ? 12.0 : 0.0; }},
    {"walls", [](double x, double) { return static_cast<std::int64_t>(x) % 6 == 0 ? 30.0 : 0.0; }},
    {"pits", [](double x, double y) { return scramble(x, y) % 5 == 0 ? -40.0 : 0.0; }},
    {"stairs", [](double x, double y) { return 2.0 * std::floor(x / 4.0) + std::floor(y / 3.0); }},
};

inline constexpr double kMiddle = 64.3;  // middle of a ground of one root square, off the lattice

inline Ground make_flat() {
    return make_test_ground([](double, double) { return 5.0; }, 1.0, 1);
}

inline Eigen::Matrix3d turned(const Eigen::Vector3d& rotation_vector) {
    return Motion{{}, Eigen::Vector3d::Zero(), rotation_vector}.at(1.0).rotation;
}

inline World make_world(const WorldSettings& settings = {}) {
    return World::create(settings).value();
}

/// A body state at rest or with given velocities. Random arguments must be drawn beforehand: their order of evaluation
/// is unspecified.
inline BodyState at(const Eigen::Vector3d& place, const Eigen::Vector3d& velocity = {0.0, 0.0, 0.0},
                    const Eigen::Vector3d& angular_velocity = {0.0, 0.0, 0.0}) {
    BodyState state{{.pose = {.translation = place},
                     .velocity = velocity,
                     .angular_velocity = angular_velocity}};
    return state;
}

inline BodyId add(World& world, const BodySettings& settings = {}, const BodyState& state = {}) {
    return world.add(settings, state).value();
}

inline bool is_asleep(const World& world, BodyId body) {
    return world.state(body).condition == BodyCondition::asleep;
}

/// Takes steps in which no body may be too deep in the ground.
inline void take_steps(World& world, const Ground& ground, int count) {
    for (int i = 0; i < count; ++i) ASSERT_EQ(world.step(ground, kStep).too_deep, 0u) << i;
}

/// A wedge with its centre of mass off its origin and principal axes that differ from its own.
inline ConvexHull make_wedge(double scale = 1.0) {
    std::vector<Eigen::Vector3d> points{{-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                        {-0.7, 0.8, -0.4},  {-0.5, 0.1, 0.9},  {0.3, 0.4, 0.7}};
    for (Eigen::Vector3d& point : points) point *= scale;
    return ConvexHull::create(points).value();
}

/// A hammer of box, handle and knob, with its centre of mass off its origin.
inline Compound make_hammer(double scale = 1.0) {
    CompoundPart head{Box{scale * Eigen::Vector3d(0.3, 0.8, 0.3)}, {}};
    head.body_from_part.translation = scale * Eigen::Vector3d(1.0, 0.2, 0.1);
    CompoundPart handle{Capsule{scale * 0.25, scale * 0.7}, {}};
    handle.body_from_part.rotation << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
    CompoundPart knob{Sphere{scale * 0.4}, {}};
    knob.body_from_part.translation = scale * Eigen::Vector3d(-0.8, 0.0, 0.0);
    return Compound::create(std::vector<CompoundPart>{head, handle, knob}).value();
}

/// Shapes that rest in their initial pose.
inline std::vector<Shape> simple_shapes(double scale = 1.0) {
    return {Sphere{scale * 0.5}, Capsule{scale * 0.4, scale * 0.8},
            Box{scale * Eigen::Vector3d(1.0, 2.0, 0.5)}};
}

inline std::vector<Shape> all_shapes(double scale = 1.0) {
    std::vector<Shape> shapes = simple_shapes(scale);
    shapes.push_back(make_wedge(scale));
    shapes.push_back(make_hammer(scale));
    return shapes;
}

inline const char* name_of(const Shape& shape) {
    constexpr std::array<const char*, 5> kNames{"sphere", "capsule", "box", "hull", "compound"};
    return kNames[shape.index()];
}

}  // namespace terrane::test
