// SPDX-License-Identifier: MIT
#pragma once

#include "ground_lift.h"

namespace terrane::internal {

/// A shape that is moved by less than this into the ground counts as free.
inline constexpr double kFree = 1e-10;

/// A short translation after which the shape's lift is at most kFree; zero where it already is.
///
/// @param lift the shape's lift
///
/// A local optimum, found from several starts. Exact where the overlap is shallow; deep down no
/// search of all of space is made (see Deviations in freeing.cpp).
Eigen::Vector3d find_freeing(const LocalGround& local, const LocalShape& shape, double lift);

}  // namespace terrane::internal
