// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <array>

// A sphere or capsule against one column: everything on or below a triangle.
namespace terrane::internal {

/// The lift of a sphere or capsule over one triangle: see compute_column_lift().
double compute_round_lift(const LocalShape& shape, const Triangle& triangle);

/// The same over the rim of a triangle whose plane lifts the shape most at a point beside it. How much the
/// plane lifts is concave: over the triangle it is most on an edge that separates it from the point, and there
/// nearest to the edge's own most.
///
/// @param most where the plane lifts the shape most; only x and y count
double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most);

}  // namespace terrane::internal
