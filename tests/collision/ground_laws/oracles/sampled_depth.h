// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"
#include "support/random.h"

namespace terrane::test {

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
