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

/// The convex hull of lattice points, exactly: every point lies on or below every triangle. Coplanar
/// parts are triangulated in some way; points on the surface that are no corners may be in it.
///
/// @param points  all of them
/// @param chosen  indices of those whose hull it is, in increasing order
/// @param simplex four chosen points that are not on one plane
///
/// Cost: n log n as a rule, for n chosen points; 10,000 on a sphere take about 15 ms
TriangleHull make_triangle_hull(const std::vector<LatticePoint>& points,
                                std::span<const std::uint32_t> chosen,
                                const std::array<std::uint32_t, 4>& simplex);

}  // namespace terrane::internal
