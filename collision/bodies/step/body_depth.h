// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"

#include <terrane/collision/ground_contact.h>

namespace terrane::internal {

/// Depth of the whole body and the way out of its deepest part.
struct Depth {
    bool resident = true;
    double depth = 0.0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

Depth compute_depth(const RigidBody& body, const Ground& ground);

/// Largest lift of a body's parts, metres: at least how deep it is in the contact surface. At least 0.
double greatest_lift(const RigidBody& body, const Ground& ground);

/// How deep a body is in the contact surface, metres: the largest of `at_least` and its signed depth.
/// @param lift its greatest_lift(): nothing is looked at where that is no more than `at_least`
double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least);

/// Whether there is no ground under a point at any height.
bool is_outside(const Ground& ground, const WorldPos& point);

}  // namespace terrane::internal
