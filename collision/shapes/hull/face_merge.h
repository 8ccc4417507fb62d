// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/hull/hull_lattice.h"
#include "shapes/hull/triangle_hull.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A face of a hull under construction.
struct HullFace {
    Eigen::Vector3d normal;           ///< unit, outward; every point of the hull is on or below
    std::vector<std::uint32_t> loop;  ///< points, counter-clockwise seen from outside
};

/// The faces of a hull: triangles that are coplanar within the tolerance are merged.
///
/// A face grows from its largest triangle, whose plane it keeps, over neighbours within the tolerance of that plane. It
/// stays a topological disc, and a face that is not convex within four tolerances is split into its triangles again. So
/// the faces cover the hull, each side is shared by two faces, and points inside a face are in no loop.
///
/// @param tolerance lattice spacings
std::vector<HullFace> merge_coplanar(const std::vector<LatticePoint>& points,
                                     const TriangleHull& hull, double tolerance);

/// Removes points with two faces that are collinear with their neighbours: in rounds in which no two neighbours are
/// removed, each within half the tolerance of the remaining side. Every loop keeps at least three points.
void drop_collinear_points(const std::vector<LatticePoint>& points, double tolerance,
                           std::vector<HullFace>& faces);

}  // namespace terrane::internal
