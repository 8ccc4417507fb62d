// SPDX-License-Identifier: MIT
#pragma once

#include "ground_lift.h"

namespace terrane::internal {

/// A shape that is moved by less than this into the ground counts as free.
inline constexpr double kFree = 1e-10;

/// Overlaps above this much of the smallest half extent are deep: a shape is at least twice as thick.
inline constexpr double kDeep = 0.2;

/// From a free place towards the body: shorter with every round, and free all the way.
Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d);

/// A short translation after which the body's lift is at most kFree; zero where it already is.
///
/// @param lift the body's lift
///
/// A local optimum, found from several starts. Exact where the overlap is shallow; deep down no
/// search of all of space is made (see Deviations in freeing.cpp).
Eigen::Vector3d find_freeing(const LocalGround& local, const LocalBody& body, double lift);

/// Whether a translation of a length frees a body by a way that is short enough, where none is shorter than
/// `least`: the shortest, but where the overlap is deep, no more than 1.25 times as long.
///
/// @param smallest half extent of the body, metres
bool is_short_enough(double smallest, double length, double least);

}  // namespace terrane::internal
