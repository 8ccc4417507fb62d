// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>

namespace terrane::internal {

/// Corners of a triangle, which may be a segment or a point.
using Corners = std::array<Eigen::Vector3d, 3>;

/// Upper bound of the distance of a point from a closed triangle, but for a relative rounding of 2^-50; with the same
/// bits with every compiler. Above the distance by at most 2^-48 of the distance to a corner, divided by the ratio of
/// the triangle's height to its longest edge; a triangle of a ratio below 1e-9 counts as its edges.
double distance_to_triangle(const Eigen::Vector3d& p, const Corners& triangle);

}  // namespace terrane::internal
