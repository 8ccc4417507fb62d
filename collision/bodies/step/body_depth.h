// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"

#include <terrane/collision/ground_contact.h>

namespace terrane::internal {

/// Penetration of a body's deepest part.
struct Depth {
    bool resident = true;
    double depth = 0.0;                                 ///< metres, >= 0
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< escape direction
};

Depth compute_depth(const RigidBody& body, const Ground& ground);

/// Largest lift of a body, metres, >= 0: an upper bound of its penetration depth.
double greatest_lift(const RigidBody& body, const Ground& ground);

/// Larger of `at_least` and the penetration depth of a body in the contact surface, metres.
/// @param lift its greatest_lift(): where that is at most `at_least`, no depth is computed
double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least);

/// Whether there is no ground below or above a point.
bool is_outside(const Ground& ground, const WorldPos& point);

}  // namespace terrane::internal
