// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/local_shape.h"
#include "ground/surface_triangles.h"
#include "pairs/convex_core.h"

#include <optional>

namespace terrane::internal {

/// Closest points of a shrunk part and a triangle. The distances are to the surface of the part, also of a round one.
struct MeshPair {
    Eigen::Vector3d on_part = Eigen::Vector3d::Zero();  ///< on the core of a round part
    Eigen::Vector3d on_triangle = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from the triangle to the part
    double distance = 0.0;                              ///< metres; <= 0 if they intersect
    double lower = 0.0;  ///< certified lower bound of the distance, metres
};

/// Bounds of the distance between a shrunk part and a triangle, from a few separating planes.
struct PartBound {
    double distance = -kInfinity;  ///< a lower bound, metres
    double front =
        -kInfinity;  ///< height of the part's lowest point above the triangle's plane, metres
};

/// A convex part of a body, both whole and shrunk by an offset: along any direction the whole part extends beyond the
/// shrunk part by at most the offset. Spheres and capsules lose radius, boxes lose half extents, hulls are scaled about
/// the mean of their vertices. Cannot be copied or moved, because its cores point into it.
class ErodedPart {
public:
    /// @param shape outlives this
    ErodedPart(const LocalShape& shape, std::uint32_t index, double offset);
    ErodedPart(const ErodedPart&) = delete;
    ErodedPart& operator=(const ErodedPart&) = delete;

    void set_offset(double offset);

    const LocalShape& whole() const { return shape_; }
    std::uint32_t index() const { return index_; }
    bool is_round() const { return shape_.kind == ShapeKind::round; }
    double radius() const { return radius_; }  ///< radius of the shrunk part, if round
    /// A point of the shrunk part. inner_radius() is the radius of a ball around the point inside the shrunk part.
    Eigen::Vector3d inside() const { return inside_; }
    double inner_radius() const;

    /// The AABB of the whole part, widened by `margin`.
    Aabb box(double margin) const {
        const Eigen::Vector3d half = shape_.bounds + Eigen::Vector3d::Constant(margin);
        return {shape_.centre - half, shape_.centre + half};
    }
    /// Minimum of n . p over the points p of the shrunk part, for a unit direction.
    double lowest(const Eigen::Vector3d& n) const;
    /// How much farther the whole part extends than the shrunk one against a unit direction, metres: up to the offset.
    double shift(const Eigen::Vector3d& n) const;
    /// Derivative of shift() with respect to the offset, 0 to 1.
    double opening(const Eigen::Vector3d& n) const;

    /// Whether a face normal of the part's oriented box proves that a triangle is farther away than `distance`. Only
    /// for boxes and capsules; false for other parts.
    bool is_beside(const std::array<Eigen::Vector3d, 3>& corners, double distance) const;
    /// Lower bound of the distance from a triangle, from a few separating planes, metres.
    /// @param enough the search may stop at a bound of at least this, with `front` unset
    PartBound bound_distance(const SurfaceTriangle& triangle, double enough) const;
    /// Closest points of the shrunk part and a triangle. The search may stop at a lower bound above `enough`.
    MeshPair closest(const SurfaceTriangle& triangle, double enough) const;

    /// The whole part as a core, made on first use.
    const Core& whole_core() const;

private:
    double lowest_of_whole(const Eigen::Vector3d& n) const {
        return dot(n, shape_.centre) - shape_.drop(n);
    }

    const LocalShape& shape_;
    std::uint32_t index_;
    double radius_ = 0.0;                             // round
    Eigen::Vector3d half_ = Eigen::Vector3d::Zero();  // half extents of a box or a capsule's box
    std::array<Eigen::Vector3d, 3> axes_{};           // of that box
    bool has_axes_ = false;
    double reach_ = 0.0;                              // hull: farthest vertex from the mean
    double scale_ = 1.0;                              // hull
    Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();  // hull: body frame
    Eigen::Vector3d inside_;
    CoreStorage storage_;
    mutable CoreStorage whole_storage_;
    Core core_;
    mutable std::optional<Core> whole_core_;
};

/// A triangle as a core.
class TriangleCore {
public:
    explicit TriangleCore(const SurfaceTriangle& triangle);
    TriangleCore(const TriangleCore&) = delete;
    TriangleCore& operator=(const TriangleCore&) = delete;
    const Core& core() const { return core_; }

private:
    std::array<Eigen::Vector3d, 3> vertices_;  // relative to the first
    std::array<Polyhedron::Face, 2> faces_;
    Core core_;
};

/// Maximum of n . p over the corners of a triangle.
inline double highest(const SurfaceTriangle& triangle, const Eigen::Vector3d& n) {
    return std::max({dot(n, triangle.v[0]), dot(n, triangle.v[1]), dot(n, triangle.v[2])});
}

}  // namespace terrane::internal
