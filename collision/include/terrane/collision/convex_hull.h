// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <cstddef>
#include <memory>
#include <span>

namespace terrane {

class ConvexHull;
namespace internal {
struct HullData;
const HullData& hull_data(const ConvexHull& hull);
}  // namespace internal

/// The smallest convex set that contains some points; body frame, metres. Unlike the other shapes it
/// need not be around the origin. Immutable and cheap to copy: copies share what was made.
///
/// Points may be anything finite: one, the same many times, all on a line or a plane. Within
/// `tolerance`, 32 roundings (2^-48) of the largest coordinate but no more than 3e-11 of the extent, they
/// count as coplanar and collinear, so that the faces of a box stay six however it was turned. Vertices
/// are points that were given, bit for bit (-0 becomes 0), sorted by x, y, z.
///
/// No given point is farther than 1e-9 of the extent (largest over x, y and z) from the hull, or in
/// front of one of its faces, plus the rounding of the products that find out. Same points, same
/// bits, in whatever order they are given.
///
/// Threads: any number at once
class ConvexHull {
public:
    static constexpr std::size_t kMaxPoints = 100'000;
    static constexpr double kLargestCoordinate = 1e5;  ///< metres

    /// Fails with invalid_argument, naming the point or the number, where there is no point, more than
    /// kMaxPoints, or one that is not finite or has a coordinate beyond kLargestCoordinate.
    ///
    /// Cost: n log n as a rule; 10,000 points on a sphere take about 60 ms, in a ball 5 ms
    static Result<ConvexHull> create(std::span<const Eigen::Vector3d> points);

    // Moving copies, so that no hull is ever without its data.
    ConvexHull(const ConvexHull&) = default;
    ConvexHull& operator=(const ConvexHull&) = default;

    std::span<const Eigen::Vector3d> vertices() const;

    /// Faces have any number of corners. A flat hull has two, back to back; one with fewer than three
    /// vertices has none.
    std::size_t face_count() const;

private:
    explicit ConvexHull(std::shared_ptr<const internal::HullData> data);
    friend const internal::HullData& internal::hull_data(const ConvexHull& hull);

    std::shared_ptr<const internal::HullData> data_;
};

/// Never fails: what create() made is good.
Result<void> check(const ConvexHull& hull);

/// Largest distance of a point of the hull from the body's origin, metres.
double bounding_radius(const ConvexHull& hull);

/// Half of the hull's extent along its thinnest direction, metres; 0 for a flat one.
double smallest_half_extent(const ConvexHull& hull);

/// Distance that the hull reaches from the body's origin in a unit direction of the body frame, metres;
/// negative where all of it lies behind the origin.
double support_distance(const ConvexHull& hull, const Eigen::Vector3d& direction_body);

}  // namespace terrane
