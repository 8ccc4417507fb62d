// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Point of a cubic lattice with a spacing of at most 2^-59 of the largest extent. Coordinates are 0 to 2^60, which
/// makes the orientation predicate exact in 192 bits.
using LatticePoint = std::array<std::int64_t, 3>;

/// The points of a hull in canonical order: sorted by lattice point, each lattice point once.
struct LatticePoints {
    std::vector<Eigen::Vector3d> positions;  ///< input points, metres; -0 became 0
    std::vector<LatticePoint> lattice;       ///< the same points, within 2^-53 of the extent
    double extent = 0.0;                     ///< largest over the three axes, metres
    double largest = 0.0;                    ///< largest absolute coordinate, metres
    double spacing = 0.0;                    ///< of the lattice, metres; may underflow to 0
    /// A point that is at most this far from a plane or line counts as on it; in lattice spacings. It is 32 roundings
    /// (2^-53) of the largest coordinate, as a rotation can introduce, but at most 2^-35 of the extent.
    double tolerance = 0.0;
};

/// @param points finite, at least one, absolute values at most 1e100
LatticePoints make_lattice_points(std::span<const Eigen::Vector3d> points);

/// From a to b, in spacings; each component is rounded once.
Eigen::Vector3d difference(const LatticePoint& a, const LatticePoint& b);

/// (b - a) x (c - a), rounded once from its exact value, in spacings squared.
Eigen::Vector3d triangle_normal(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c);

/// Orientation predicate: the exact sign of ((b - a) x (c - a)) . (d - a). 1 if a, b, c are counter-clockwise seen from
/// d, 0 if the four are coplanar.
int side_of_plane(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                  const LatticePoint& d);

/// 2D orientation predicate: the exact sign of component `axis` of (b - a) x (c - a); 1 is a left turn.
int turn(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, int axis);

/// No vertex, point or face.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// A closed surface of triangles, counter-clockwise seen from outside. Side i of a triangle runs from
/// its vertex i to the next.
struct TriangleHull {
    using Triangle = std::array<std::uint32_t, 3>;
    std::vector<Triangle> vertices;  ///< indices of points
    std::vector<Triangle> across;    ///< the triangle across each side
};

/// The exact convex hull of lattice points: no chosen point is above any triangle. Coplanar regions are triangulated
/// arbitrarily; vertices of triangles may be points of the surface that are not corners of the hull.
///
/// @param chosen  indices of the points to enclose, in increasing order
/// @param simplex four chosen points that are not coplanar
///
/// Cost: usually O(n log n) in the chosen points; 10,000 on a sphere take about 15 ms
TriangleHull make_triangle_hull(const std::vector<LatticePoint>& points,
                                std::span<const std::uint32_t> chosen,
                                const std::array<std::uint32_t, 4>& simplex);

/// A face of a hull under construction.
struct HullFace {
    Eigen::Vector3d normal;           ///< unit, outward; the hull is on or below the face
    std::vector<std::uint32_t> loop;  ///< points, counter-clockwise seen from outside
};

/// The faces of a hull: triangles that are coplanar within the tolerance are merged.
///
/// A face grows from its largest triangle, whose plane it keeps, over neighbours within the tolerance of that plane. It
/// stays a topological disc, and a face that is not convex within four tolerances is split into its triangles again.
/// Therefore the faces cover the hull, each side is shared by two faces, and points in the interior of a face are in no
/// loop.
///
/// @param tolerance lattice spacings
std::vector<HullFace> merge_coplanar(const std::vector<LatticePoint>& points,
                                     const TriangleHull& hull, double tolerance);

/// Removes the points that lie on exactly two faces and within half the tolerance of the segment between their
/// neighbours. Works in rounds; no round removes two neighbouring points. Every loop keeps at least three points.
void drop_collinear_points(const std::vector<LatticePoint>& points, double tolerance,
                           std::vector<HullFace>& faces);

/// Initial simplex: each corner is the point farthest from the point, line or plane through the previous corners.
struct Simplex {
    int dimension = 0;  ///< of the points, within the tolerance: 0 point, 1 line, 2 plane, 3 solid
    std::array<std::uint32_t, 4> corners{};  ///< the first dimension + 1 are valid
    double thickness = 0.0;                  ///< extent in the next dimension, in lattice spacings
};

/// @param chosen at least one; @param tolerance in lattice spacings
Simplex find_simplex(const std::vector<LatticePoint>& points, std::span<const std::uint32_t> chosen,
                     double tolerance);

/// The two faces of a flat hull: the convex hull of the points in projection along the axis nearest to the simplex's
/// normal, and its reverse. Empty if that polygon has fewer than three corners.
std::vector<HullFace> make_flat_faces(const std::vector<LatticePoint>& points,
                                      std::span<const std::uint32_t> chosen,
                                      const Simplex& simplex);

}  // namespace terrane::internal
