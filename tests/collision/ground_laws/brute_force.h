// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground_laws/oracle_shape.h"
#include "support/random.h"

namespace terrane::test {

/// Lift of a shape: the largest over all triangles of the soup, minus infinity if none is above or below it. For hulls,
/// every edge is clipped by the three vertical planes of a triangle and every corner of a triangle is tested against
/// every face; for capsules, a golden-section search finds the best sphere along the core.
///
/// @param offset added to the pose's translation, for differences too small for a double far from the origin
/// @param least  lifts up to this may be reported as `least`
template <class Real>
Real brute_lift(const Soup& soup, const OracleShape& shape, const Pose& pose,
                const Vec<Real>& offset = Vec<Real>::Zero(),
                Real least = -std::numeric_limits<Real>::infinity());

/// Whether the lift exceeds a value; stops at the first point where it does.
template <class Real>
bool is_deeper(const Soup& soup, const OracleShape& shape, const Pose& pose,
               const Vec<Real>& offset, Real lift);

/// Lift of a sphere over one triangle in the same frame.
template <class Real>
Real sphere_lift(const Vec<Real>& centre, Real radius, const SoupTriangle<Real>& triangle);

/// Distance of a separated shape from the nearest triangle of the soup: the least over all vertex-face and edge-edge
/// pairs of every part and triangle, at most `largest`.
template <class Real>
Real brute_gap(const Soup& soup, const OracleShape& shape, const Pose& pose, Real largest);

/// Length of the minimum translation of an overlapping shape, metres; infinity if it exceeds `largest`.
///
/// At the minimum at most three pairs of features are active constraints, with multipliers >= 0 (Karush-Kuhn-Tucker
/// conditions). All pairs within `largest` of touching are collected and all sets of one to three of them solved; the
/// result is the shortest solution that separates the whole shape according to brute_lift().
///
/// Cost: cubic in the number of near pairs; suited to shallow overlaps
long double brute_depth(const Soup& soup, const OracleShape& shape, const Pose& pose,
                        long double largest);

/// Effort of sampled_depth().
struct SampledDepthSettings {
    int samples = 400;      ///< random offsets
    int starts = 8;         ///< of them are refined
    int refinements = 120;  ///< steps per refinement
};

/// Shortest separating translation of an overlapping shape found by a random search, at most `known`.
///
/// After a horizontal offset (x, y), raising a shape by its brute-force lift there separates it, and raising it by less
/// does not. So the depth is the minimum of
/// (x, y, max(0, lift))
/// over all offsets. Offsets are sampled in the disc of radius `known`, and the best are refined by a random walk with
/// an adaptive step. The result is an upper bound at any depth and shares no method with the library.
///
/// @param best_out receives a translation of that length if it is not null and one shorter than `known` is found
double sampled_depth(const Soup& soup, const OracleShape& shape, const Pose& pose, double known,
                     const SampledDepthSettings& settings, Random& random,
                     Eigen::Vector3d* best_out = nullptr);

}  // namespace terrane::test
