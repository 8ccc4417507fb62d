// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Largest of surface minus z over a shape's points that lie over ground, and over every triangle of
/// the soup; minus infinity where nothing lies over another. Hulls: every edge is cut by the three
/// walls of a triangle, every corner of a triangle is looked at from every face. Capsules: the best
/// sphere on the core, by golden section.
///
/// @param offset added to the pose's translation: differences that a double far out cannot hold
/// @param least  what is not above this need not be found: answers at or below it may be `least`
template <class Real>
Real brute_lift(const Soup& soup, const OracleShape& shape, const Pose& pose,
                const Vec<Real>& offset = Vec<Real>::Zero(),
                Real least = -std::numeric_limits<Real>::infinity());

/// The same with an answer as soon as some point is deeper than a lift.
template <class Real>
bool is_deeper(const Soup& soup, const OracleShape& shape, const Pose& pose,
               const Vec<Real>& offset, Real lift);

/// Over one triangle, for a sphere that is seen from the triangle's frame.
template <class Real>
Real sphere_lift(const Vec<Real>& centre, Real radius, const SoupTriangle<Real>& triangle);

}  // namespace terrane::test
