// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

namespace terrane {

/// Sphere around the origin of the body frame. Shapes are closed sets; lengths are metres.
struct Sphere {
    double radius = 0.5;  ///< metres, >= 0

    Result<void> validate() const;  ///< as validate() of a Shape
};

/// All points within `radius` of the segment from (0, 0, -half_height) to (0, 0, half_height).
struct Capsule {
    double radius = 0.4;       ///< metres, >= 0
    double half_height = 0.8;  ///< from the centre to the middle of a cap, metres, >= 0

    Result<void> validate() const;  ///< as validate() of a Shape
};

/// Box around the origin, along the axes of the body frame.
struct Box {
    /// Along x, y, z, metres, >= 0.
    Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.5);

    Result<void> validate() const;  ///< as validate() of a Shape
};

class ConvexHull;
namespace internal {
struct HullData;
/// The data of a hull that queries read.
const HullData& hull_data(const ConvexHull& hull);
}  // namespace internal

/// The convex hull of points; body frame, metres. Unlike the other shapes it need not contain the origin. Immutable;
/// copies share their data.
///
/// Degenerate input is allowed: one point, equal points, collinear or coplanar points. A point counts as on a plane or
/// line if it is within 2^-48 times the largest coordinate (32 roundings), but at most 3e-11 times the extent (largest
/// over x, y and z). A rotated box therefore keeps six faces. Vertices are input points, bit for bit (-0 becomes 0),
/// sorted by x, y, z.
///
/// No input point lies farther outside the hull, or outside any of its face planes, than 1e-9 of the extent plus the
/// rounding of the dot products. The bits do not depend on the order of the points, and the hull of vertices() has the
/// same bits.
///
/// Threads: any number at once
class ConvexHull {
public:
    /// Largest number of points accepted by create().
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

    /// Faces are polygons of three or more vertices. A flat hull has two faces, back to back; a hull with fewer than
    /// three vertices has none.
    std::size_t face_count() const;
    /// The corners of a face, counter-clockwise seen from outside, as indices into vertices(). Every edge is shared by
    /// two faces, which traverse it in opposite directions.
    ///
    /// @param index below face_count()
    std::span<const std::uint32_t> face(std::size_t index) const;

    /// Never fails: create() has checked the points.
    Result<void> validate() const { return {}; }

private:
    explicit ConvexHull(std::shared_ptr<const internal::HullData> data);
    friend const internal::HullData& internal::hull_data(const ConvexHull& hull);

    std::shared_ptr<const internal::HullData> data_;
};

/// Largest distance of a point of the hull from the body's origin, metres.
double bounding_radius(const ConvexHull& hull);

/// Half of the hull's width, the extent along its thinnest direction, metres; 0 for a flat hull.
double smallest_half_extent(const ConvexHull& hull);

/// Support function of a unit direction in the body frame, metres; negative if the whole hull lies behind the origin.
double support_distance(const ConvexHull& hull, const Eigen::Vector3d& direction_body);

/// Shape types allowed as parts of a compound.
using ConvexShape = std::variant<Sphere, Capsule, Box, ConvexHull>;

/// A convex shape and its pose in the compound.
struct CompoundPart {
    ConvexShape shape;    ///< in the part's own frame
    Pose body_from_part;  ///< the rotation must be orthonormal to 1e-6
};

class Compound;
namespace internal {
struct CompoundData;
/// The data of a compound that queries read.
const CompoundData& compound_data(const Compound& compound);
}  // namespace internal

/// The union of convex shapes; body frame, metres. Parts may overlap and keep their order: contacts name them by index.
/// Immutable; copies share their data.
///
/// Threads: any number at once
class Compound {
public:
    /// Largest number of parts in a compound.
    static constexpr std::size_t kMaxParts = 100'000;
    static constexpr double kLargestOffset = 1e5;  ///< largest component of a translation, metres

    /// Fails: invalid_argument, naming the part, for no part or more than kMaxParts; a shape that validate() refuses; a
    ///        translation that is not finite or beyond kLargestOffset; a rotation that is not orthonormal to 1e-6 with
    ///        determinant 1
    static Result<Compound> create(std::span<const CompoundPart> parts);

    /// The surface of a triangle mesh: one flat hull per triangle, in order. The mesh need not be closed, and its
    /// winding is ignored. It has no interior: a shape inside a closed mesh touches nothing. For a solid, pass convex
    /// solid pieces to create().
    ///
    /// Fails: invalid_argument, naming the triangle, for no triangle or more than kMaxParts; an index beyond the
    ///        vertices; a vertex that is not finite or has a coordinate beyond 1e5 m
    /// Cost:  3 to 7 microseconds and about 1 kB per triangle
    static Result<Compound> from_triangles(std::span<const Eigen::Vector3d> vertices,
                                           std::span<const std::array<std::uint32_t, 3>> triangles);

    // A move copies, so that a moved-from compound keeps its data.
    Compound(const Compound&) = default;
    Compound& operator=(const Compound&) = default;

    /// The parts, in the order given to create().
    std::span<const CompoundPart> parts() const;

    /// Bounding box of every part, body frame, in the order of parts().
    std::span<const Aabb> bounds() const;

    /// Never fails: create() has checked the parts.
    Result<void> validate() const { return {}; }

private:
    explicit Compound(std::shared_ptr<const internal::CompoundData> data);
    friend const internal::CompoundData& internal::compound_data(const Compound& compound);
    friend double bounding_radius(const Compound& compound);
    friend double smallest_half_extent(const Compound& compound);

    std::shared_ptr<const internal::CompoundData> data_;
};

/// Largest distance of a point of any part from the body's origin, metres.
double bounding_radius(const Compound& compound);

/// The smallest half extent of any part, metres: tolerances must suit the thinnest part. 0 if a part is flat.
double smallest_half_extent(const Compound& compound);

/// Support function of a unit direction in the body frame, metres; negative if the whole compound lies behind the
/// origin.
///
/// Cost: linear in the number of parts
double support_distance(const Compound& compound, const Eigen::Vector3d& direction_body);

/// A convex shape or a union of them.
using Shape = std::variant<Sphere, Capsule, Box, ConvexHull, Compound>;

/// Fails: invalid_argument, naming the field and its value, for a size that is negative, not finite or above 1e5 m.
///        Sizes of 0 are valid
Result<void> validate(const Shape& shape);

/// Largest distance of a point of the shape from its origin, metres.
double bounding_radius(const Shape& shape);

/// Half of the shape's extent along its thinnest direction, metres. Tolerances scale with it.
double smallest_half_extent(const Shape& shape);

/// Default of BodySettings::contact_tolerance: the smaller of 1 cm and a tenth of the smallest half extent, metres.
double default_contact_tolerance(const Shape& shape);

/// Support function of a unit direction in the body frame, metres.
double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body);

}  // namespace terrane
