// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground_laws/oracle_shape.h"
#include "support/random.h"

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

/// Distance of a separated shape to the nearest triangle of the soup: the least over vertex-face and edge-edge pairs of
/// every triangle and every part; `largest` where none is nearer.
template <class Real>
Real brute_gap(const Soup& soup, const OracleShape& shape, const Pose& pose, Real largest);

/// Length of the minimum translation of an overlapping shape, if it is at most `largest`, else infinity; metres.
///
/// At the minimum at most three pairs of features are active constraints with multipliers >= 0 (the conditions of
/// Karush, Kuhn and Tucker). So all pairs of features within `largest` of touching are found, all sets of one to three
/// of them are solved, and the result is the shortest solution that separates the whole shape by brute_lift.
///
/// Cost: the third power of the number of near pairs: for shallow overlaps
long double brute_depth(const Soup& soup, const OracleShape& shape, const Pose& pose,
                        long double largest);

/// How hard sampled_depth() tries.
struct SampledDepthSettings {
    int samples = 400;      ///< random offsets
    int starts = 8;         ///< the number of them that are refined
    int refinements = 120;  ///< steps of each refinement
};

/// Length of the shortest separating translation that a random search finds for an overlapping shape, at most `known`.
///
/// After a sideways offset (x, y) a shape is separated by raising it by its brute-force lift there, and by no less: the
/// depth is the least of |(x, y, max(0, lift))| over all offsets. Offsets in the disc of radius `known` are sampled,
/// and the best of them are refined by a random walk with an adaptive step. An upper bound of the depth, at any depth,
/// that shares no method with the library.
///
/// @param best_out a translation of that length, if it is not null and one shorter than `known` is found
double sampled_depth(const Soup& soup, const OracleShape& shape, const Pose& pose, double known,
                     const SampledDepthSettings& settings, Random& random,
                     Eigen::Vector3d* best_out = nullptr);

}  // namespace terrane::test
