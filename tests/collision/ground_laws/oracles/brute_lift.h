// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Lift of a shape: the largest over every triangle of the soup; minus infinity where there is none below or above it.
/// Hulls: every edge is clipped by the three walls of a triangle, every corner of a triangle is tested against every
/// face.
/// Capsules: the best sphere on the core, by golden section.
///
/// @param offset added to the pose's translation: differences too small for a double far from the origin
/// @param least  lifts up to this need not be found: `least` may be returned instead
template <class Real>
Real brute_lift(const Soup& soup, const OracleShape& shape, const Pose& pose,
                const Vec<Real>& offset = Vec<Real>::Zero(),
                Real least = -std::numeric_limits<Real>::infinity());

/// Whether the lift is above a value; ends at the first point that is.
template <class Real>
bool is_deeper(const Soup& soup, const OracleShape& shape, const Pose& pose,
               const Vec<Real>& offset, Real lift);

/// Lift of a sphere over one triangle, in the same frame.
template <class Real>
Real sphere_lift(const Vec<Real>& centre, Real radius, const SoupTriangle<Real>& triangle);

}  // namespace terrane::test
