// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <vector>

// Bodies that fall onto the ground of a row, and how deep they get.
namespace terrane::extremes {

/// Bodies that are simulated together.
struct Fall {
    std::vector<Shape> shapes;          ///< a body of each
    double x = 0.3, y = 0.7;            ///< of the first body, metres; the others lie to the east
    double gap = 0.0;                   ///< metres between two bodies, and to the ground below
    Eigen::Vector3d velocity{0, 0, 0};  ///< m/s
    double dt = 1.0 / 60.0;             ///< seconds
    int steps = 60;                     ///< number of steps
    double max_substep = 1.0 / 120.0;   ///< WorldSettings::max_substep
};

/// A sphere, a capsule, a box, a hull and a compound whose largest half extent is `size`, metres.
std::vector<Shape> shapes_of_size(double size);

/// The largest of depth / contact_tolerance over bodies and steps, by the contact query signed_distance(). Infinite
/// where a body was parked; NaN where a body is refused or has no ground below, or a state is not finite.
double worst_depth_share(const Ground& ground, const Fall& fall);

/// The same of a body at its pose, 0 where it does not overlap the ground.
double depth_share(const Ground& ground, const BodySettings& settings, const BodyState& state);

/// A body of this state without velocity.
BodyState at_place(double x, double y, double z);

}  // namespace terrane::extremes
