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

/// When search_min_translation() stops before it has proved that its answer is the minimum.
struct SearchLimits {
    static constexpr int kMostSplits = 1024;
    double deep_share =
        1.0;  ///< a deep answer is accepted if the minimum is at least this share of it
    int most_splits = kMostSplits;  ///< triangles of offsets that are bisected at most
    /// Cells that are tested at most where the overlap is deeper than the shape is thick: up to half the thickness the
    /// minimum is promised. Lifts that a window holds do not count, because their cost is bounded.
    std::int64_t most_cells = 1 << 17;
};

/// The minimum translation of a body, by branch and bound over all sideways offsets.
///
/// The answer is within 1e-7 of its length and 1e-10 m of the minimum, unless a limit ended the search: lower_bound is
/// what was proved by then. Cells that are not resident count as no ground.
///
/// @param known separates the body; the answer is no longer, and its bound no less
///
/// Allocates: nothing; 80 KB of stack
/// Cost:      some lifts for each triangle of offsets
MinTranslation search_min_translation(const LocalGround& local, const LocalBody& body,
                                      const MinTranslation& known, const SearchLimits& limits);

/// Lifts up to this count as separated, metres.
inline constexpr double kSeparatedLift = 1e-10;

/// Overlaps above this share of the smallest half extent are deep.
inline constexpr double kDeep = 0.2;

/// Shortens a separating translation: a local minimum by repeated projection onto half-spaces; it separates too.
Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d);

/// Whether a separating translation is long enough to be accepted as the minimum one, whose length is at least `least`:
/// within rounding, or, where the overlap is deep, within the share that the caller allows.
bool is_short_enough(const LocalBody& body, double length, double least, double deep_share);

/// The minimum translation: the shortest after which the body's lift is at most kSeparatedLift; zero where it is
/// already.
///
/// @param lift the body's lift
MinTranslation find_min_translation(const LocalGround& local, const LocalBody& body, double lift,
                                    const SearchLimits& limits);

}  // namespace terrane::internal
