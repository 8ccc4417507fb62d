// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/ground_lift.h"

namespace terrane::internal {

/// A separating translation of a body, and a lower bound of the length of the minimum one.
struct MinTranslation {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    double lower_bound =
        0.0;  ///< no shorter translation separates the body, metres; at most the length of d
};

/// Limits at which search_min_translation() stops before it has proved the minimum.
struct SearchLimits {
    static constexpr int kMostSplits = 1024;
    int most_splits = kMostSplits;  ///< largest number of bisected triangles of offsets
    /// Largest number of tested cells if the overlap is deeper than the shape is thick. Up to half the thickness the
    /// minimum is guaranteed. Lifts within a window do not count, because their cost is bounded.
    std::int64_t most_cells = 1 << 17;
};

/// The minimum translation of a body, by branch and bound over all sideways offsets.
///
/// The answer exceeds the minimum by at most 1e-7 of its length plus 1e-10 m, unless a limit ended the search;
/// lower_bound is what the search has proved. Cells that are not resident are treated as if there were no ground.
///
/// @param known separates the body; the answer is not longer than this, and its lower bound is not smaller
///
/// Allocates: nothing; 80 KB of stack
/// Cost:      a few lifts per triangle of offsets
MinTranslation search_min_translation(const LocalGround& local, const LocalBody& body,
                                      const MinTranslation& known, const SearchLimits& limits);

/// Largest lift that counts as separated, metres.
inline constexpr double kSeparatedLift = 1e-10;

/// Overlaps above this fraction of the smallest half extent are deep.
inline constexpr double kDeep = 0.2;

/// Shortens a separating translation to a local minimum by repeated projection onto half-spaces. The result also
/// separates the body.
Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d);

/// Whether a separating translation of this length is the minimum one, within rounding.
///
/// @param least lower bound of the minimum's length, metres
inline bool is_minimum(double length, double least) {
    return length <= least * (1.0 + 1e-12) + kSeparatedLift;
}

/// A separating translation, no longer than the lift, found without a search: it may be longer than the minimum.
///
/// @param lift the body's lift, above 0
Eigen::Vector3d find_short_translation(const LocalGround& local, const LocalBody& body,
                                       double lift);

/// The minimum translation: the shortest after which the body's lift is at most kSeparatedLift; zero if the body is
/// separated already.
///
/// @param lift the body's lift
MinTranslation find_min_translation(const LocalGround& local, const LocalBody& body, double lift,
                                    const SearchLimits& limits = {});

}  // namespace terrane::internal
