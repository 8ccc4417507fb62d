// SPDX-License-Identifier: MIT
#pragma once

#include "support/heights/table_ground.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

namespace terrane::test {

inline constexpr double kMiddle = 64.3;  // of a ground of one root square, off the lattice

inline Ground make_flat() {
    return make_test_ground([](double, double) { return 5.0; }, 1.0, 1);
}

inline Eigen::Matrix3d turned(const Eigen::Vector3d& rotation_vector) {
    return Motion{{}, Eigen::Vector3d::Zero(), rotation_vector}.at(1.0).rotation;
}

inline World make_world(const WorldSettings& settings = {}) {
    Result<World> world = World::create(settings);
    EXPECT_TRUE(world.has_value());
    return std::move(*world);
}

/// Random poses and velocities are set one by one: the order of evaluation of arguments is unspecified.
inline BodyState at(const Eigen::Vector3d& place, const Eigen::Vector3d& velocity = {0.0, 0.0, 0.0},
                    const Eigen::Vector3d& angular_velocity = {0.0, 0.0, 0.0}) {
    BodyState state;
    state.pose.translation = place;
    state.velocity = velocity;
    state.angular_velocity = angular_velocity;
    return state;
}

/// A wedge whose centre of mass is off its origin, and whose axes are not its principal axes.
inline ConvexHull make_wedge(double scale = 1.0) {
    std::vector<Eigen::Vector3d> points{{-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                        {-0.7, 0.8, -0.4},  {-0.5, 0.1, 0.9},  {0.3, 0.4, 0.7}};
    for (Eigen::Vector3d& point : points) point *= scale;
    return ConvexHull::create(points).value();
}

/// A hammer: a box, a handle and a knob, off its origin.
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
