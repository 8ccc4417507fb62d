// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"
#include "support/random.h"

namespace terrane::test {

/// How hard sampled_depth() tries.
struct SampledDepthSettings {
    int samples = 400;      ///< translations that are tried for being shorter than the best so far
    int starts = 8;         ///< of these, how many are refined
    int refinements = 120;  ///< steps of each refinement
};

/// Length of the shortest translation that random search finds to free an overlapping shape, at most `known`.
///
/// After a sideways offset (x, y) a shape is free where it is raised by its brute-force lift there, and no
/// less frees it: so depth is the least of |(x, y, max(0, lift))| over all offsets. Offsets in the disc of
/// radius `known` are sampled, and the best of them are refined by a random walk whose step adapts. An upper
/// bound of the depth that shares no method with the library, and needs no depth to be shallow.
///
/// @param best_out a translation of that length, if it is not null and one shorter than `known` is found
double sampled_depth(const Soup& soup, const OracleShape& shape, const Pose& pose, double known,
                     const SampledDepthSettings& settings, Random& random,
                     Eigen::Vector3d* best_out = nullptr);

}  // namespace terrane::test
