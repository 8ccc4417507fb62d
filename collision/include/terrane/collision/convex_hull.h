// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace terrane {

class ConvexHull;
namespace internal {
struct HullData;
/// The hull as the queries read it.
const HullData& hull_data(const ConvexHull& hull);
}  // namespace internal

/// The convex hull of points; body frame, metres. Unlike the other shapes it need not contain the origin. Immutable;
/// copies share their data.
///
/// Degenerate input is allowed: one point, equal points, collinear or coplanar points. Points count as coplanar and
/// collinear within a tolerance of 32 roundings (2^-48) of the largest coordinate, at most 3e-11 of the extent, so that
/// a rotated box keeps six faces. Vertices are input points, bit for bit (-0 becomes 0), sorted by x, y, z.
///
/// No input point is farther than 1e-9 of the extent (largest over x, y and z) outside the hull or one of its face
/// planes, plus the rounding of the products that measure it. The bits do not depend on the order of the points, and
/// the hull of its vertices() has the same bits.
///
/// Threads: any number at once
class ConvexHull {
public:
    /// Most points that create() takes.
    static constexpr std::size_t kMaxPoints = 100'000;
    static constexpr double kLargestCoordinate = 1e5;  ///< metres

    /// Fails: invalid_argument, naming the point or the count, for no point or more than kMaxPoints; a point that is
    ///        not finite or has a coordinate beyond kLargestCoordinate
    /// Cost:  usually O(n log n); 10,000 points on a sphere take about 60 ms, in a ball 5 ms
    static Result<ConvexHull> create(std::span<const Eigen::Vector3d> points);

    // A move copies, so that a moved-from hull keeps its data.
    ConvexHull(const ConvexHull&) = default;
    ConvexHull& operator=(const ConvexHull&) = default;

    /// Vertices in the shape's frame, metres.
    std::span<const Eigen::Vector3d> vertices() const;

    /// Faces are polygons of three or more vertices. A flat hull has two, back to back; one with fewer than three
    /// vertices has none.
    std::size_t face_count() const;
    /// The corners of a face, counter-clockwise seen from outside, as indices of vertices(). Every edge is of two
    /// faces, once in each direction.
    ///
    /// @param index below face_count()
    std::span<const std::uint32_t> face(std::size_t index) const;

private:
    explicit ConvexHull(std::shared_ptr<const internal::HullData> data);
    friend const internal::HullData& internal::hull_data(const ConvexHull& hull);

    std::shared_ptr<const internal::HullData> data_;
};

/// Never fails: create() has checked the points.
Result<void> check(const ConvexHull& hull);

/// Largest distance of a point of the hull from the body's origin, metres.
double bounding_radius(const ConvexHull& hull);

/// Half of the hull's width, the extent along its thinnest direction, metres; 0 for a flat hull.
double smallest_half_extent(const ConvexHull& hull);

/// Support function: largest coordinate of the hull along a unit direction of the body frame, metres; negative where
/// all of it is behind the origin.
double support_distance(const ConvexHull& hull, const Eigen::Vector3d& direction_body);

}  // namespace terrane
