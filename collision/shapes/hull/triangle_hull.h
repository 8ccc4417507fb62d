// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/hull/hull_lattice.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// No vertex, point or face.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// A closed surface of triangles, counter-clockwise seen from outside. Side i of a triangle runs from
/// its vertex i to the next.
struct TriangleHull {
    using Triangle = std::array<std::uint32_t, 3>;
    std::vector<Triangle> vertices;  ///< indices of points
    std::vector<Triangle> across;    ///< the triangle across each side
};

/// The exact convex hull of lattice points: no chosen point is above any triangle. Coplanar parts have an arbitrary
/// triangulation, which may contain surface points that are no corners.
///
/// @param chosen  indices of the points to enclose, in increasing order
/// @param simplex four chosen points that are not coplanar
///
/// Cost: usually O(n log n) for n chosen points; 10,000 on a sphere take about 15 ms
TriangleHull make_triangle_hull(const std::vector<LatticePoint>& points,
                                std::span<const std::uint32_t> chosen,
                                const std::array<std::uint32_t, 4>& simplex);

}  // namespace terrane::internal
