// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/motion.h>
#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Largest component of a motion's rotation vector, radians: a spin of 1e6 rad/s for 10 s.
inline constexpr double kMostRotation = 1e7;

/// Whether a point is within kFarthestPlace of the origin along each axis; false for NaN.
bool is_valid_place(const WorldPos& point_world);
/// Whether check(shape) succeeds, the place is valid, and the rotation is orthonormal to 1e-6 with determinant 1.
bool is_valid_query(const Shape& shape, const Pose& pose);
/// The same of a motion's start; its translation is at most kFarthestPlace, its rotation kMostRotation.
bool is_valid_query(const Shape& shape, const Motion& motion);
/// Whether doubles at both ends of a motion are at most a quarter of a tolerance apart, metres: a cast cannot tell
/// smaller gaps apart.
bool is_resolved(const Motion& motion, double tolerance);

}  // namespace terrane::internal
