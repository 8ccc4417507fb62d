// SPDX-License-Identifier: MIT
#pragma once

#include "ground/depth/min_translation_search.h"

namespace terrane::internal {

/// A shape that is moved by less than this into the ground counts as free.
inline constexpr double kSeparatedLift = 1e-10;

/// Overlaps above this much of the smallest half extent are deep: a shape is at least twice as thick.
inline constexpr double kDeep = 0.2;

/// From a free place towards the body: shorter with every round, and free all the way.
Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d);

/// Whether a translation of a length frees a body by little more than the shortest, which is not shorter than `least`:
/// by no more than rounding, or, where the shortest is deep, by the share that the caller allows.
bool is_short_enough(const LocalBody& body, double length, double least, double deep_share);

/// The shortest translation after which the body's lift is at most kSeparatedLift; zero where it already is.
///
/// @param lift the body's lift
MinTranslation find_min_translation(const LocalGround& local, const LocalBody& body, double lift,
                            const SearchLimits& limits);

}  // namespace terrane::internal
