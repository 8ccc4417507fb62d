// SPDX-License-Identifier: MIT
#pragma once

#include "ground/depth/min_translation_search.h"

namespace terrane::internal {

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
