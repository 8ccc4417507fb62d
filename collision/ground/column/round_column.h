// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <array>

// A sphere or capsule against one column: everything on or below a triangle.
namespace terrane::internal {

/// The lift of a sphere or capsule over one triangle: see compute_column_lift().
double compute_round_lift(const LocalShape& shape, const Triangle& triangle);

/// The same where the lift over the triangle's whole plane is largest at a point beside the triangle. The lift is
/// concave in x and y, so that over the triangle it is largest on an edge that separates the triangle from the point.
///
/// @param most where the lift over the plane is largest; only x and y count
double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most);

}  // namespace terrane::internal
