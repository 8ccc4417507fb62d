// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace terrane::test {

inline BodyWorld make_world(const BodyWorldSettings& settings = {}) {
    Result<BodyWorld> world = BodyWorld::create(settings);
    EXPECT_TRUE(world.has_value());
    return std::move(*world);
}

/// Random places and velocities are better set one by one: the order of arguments is the compiler's.
inline BodyState at(const Eigen::Vector3d& place, const Eigen::Vector3d& velocity = {0.0, 0.0, 0.0},
                    const Eigen::Vector3d& angular_velocity = {0.0, 0.0, 0.0}) {
    BodyState state;
    state.pose.translation = place;
    state.velocity = velocity;
    state.angular_velocity = angular_velocity;
    return state;
}

inline std::vector<Shape> all_shapes() {
    return {Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 2.0, 0.5}}};
}

inline const char* name_of(const Shape& shape) {
    return std::holds_alternative<Sphere>(shape)    ? "sphere"
           : std::holds_alternative<Capsule>(shape) ? "capsule"
                                                    : "box";
}

}  // namespace terrane::test
