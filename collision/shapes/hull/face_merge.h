// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/hull/hull_lattice.h"
#include "shapes/hull/triangle_hull.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A face of a hull that is being made.
struct HullFace {
    Eigen::Vector3d normal;           ///< unit, outward; every point of the hull is on or below
    std::vector<std::uint32_t> loop;  ///< points, counter-clockwise seen from outside
};

/// The triangles of a hull, those that are coplanar within the tolerance as one face.
///
/// A face grows from its largest triangle, whose plane it keeps, over what is within the tolerance of
/// that plane. It stays a disc, and a face that would not be convex within four tolerances falls apart
/// into its triangles. So the faces cover the hull, each side is that of two of them, and points that
/// lie inside a face are in no loop.
///
/// @param tolerance lattice spacings
std::vector<HullFace> merge_coplanar(const std::vector<LatticePoint>& points,
                                     const TriangleHull& hull, double tolerance);

/// Takes points out of loops that only part two faces and lie straight between their neighbours: in
/// rounds in which no two neighbours go, each within half the tolerance of the line that stays. No
/// loop falls below three points.
void drop_collinear_points(const std::vector<LatticePoint>& points, double tolerance,
                          std::vector<HullFace>& faces);

}  // namespace terrane::internal
