// SPDX-License-Identifier: MIT
#pragma once

#include "ground_lift.h"

namespace terrane::internal {

/// The shortest translation that frees a body, where it is shorter than one that is known to; else that one.
///
/// Of boxes and hulls every choice of ways out that could be shorter is tried, of round shapes one from each side
/// of a column; where there are too many, the shortest so far.
///
/// @param known frees the body
Eigen::Vector3d find_shortest_way(const LocalGround& local, const LocalBody& body,
                                  const Eigen::Vector3d& known);

}  // namespace terrane::internal
