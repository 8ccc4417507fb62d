// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"
#include "shapes/polyhedron.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>

#include <array>

namespace terrane::internal {

/// A hull in world axes, relative to the middle of its bounding box.
struct LocalHull {
    /// All points p of the hull have normal . p >= -drop.
    struct Plane {
        Eigen::Vector3d normal;
        double drop;
    };
    /// All points p of the hull have low <= x p.x + y p.y <= high.
    struct Strip {
        double x, y;  ///< not normalised
        double low, high;
    };

    const Polyhedron* shape = nullptr;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d middle;  ///< of the bounding box, from the body's origin
    Eigen::Vector3d bounds;  ///< half extents of the bounding box
    static constexpr std::size_t kMostPlanes = 8;
    std::array<Plane, kMostPlanes>
        planes;  ///< faces around the lowest vertex, then planes of fixed slopes
    std::size_t plane_count = 0;
    std::size_t face_count = 0;  ///< planes that are faces; they come first
    Strip strip;                 ///< contains the outline in plan
    bool is_narrow = false;      ///< whether the strip is much narrower than it is long

    Eigen::Vector3d to_body(const Eigen::Vector3d& n) const { return rotated_back(rotation, n); }
    Eigen::Vector3d vertex(std::uint32_t i) const {
        return rotated(rotation, shape->vertices[i]) - middle;
    }
    /// Index of the vertex that is lowest along a direction of any length.
    std::uint32_t lowest(const Eigen::Vector3d& n) const {
        return find_extreme(*shape, -to_body(n));
    }
    /// Extent of the hull from its middle against a direction, times the direction's length.
    double drop(const Eigen::Vector3d& n) const { return -dot(n, vertex(lowest(n))); }
};

/// @param rotation orthonormal to 1e-6
void make_local_hull(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out);

/// The edge between two vertices, or null. Cost: O(log edges)
const Polyhedron::Edge* find_edge(const Polyhedron& shape, std::uint32_t a, std::uint32_t b);

/// The support feature against a unit direction: an edge or a face if it is perpendicular to the direction within 1e-9,
/// else a vertex.
///
/// @param middle_out middle of the feature, relative to the hull's middle
ShapeFeature find_deepest(const LocalHull& hull, const Eigen::Vector3d& n,
                          Eigen::Vector3d& middle_out);

enum class ShapeKind {
    round,  ///< sphere or capsule: all points within a radius of the core
    box,
    hull,
};

/// The support point of a shape against a direction, and its feature.
struct DeepestPoint {
    Eigen::Vector3d point;
    ShapeFeature feature;
};

/// A convex shape in a local frame with world axes. A sphere is a capsule whose core is a point. All shapes but hulls
/// are symmetric about their centre.
struct LocalShape {
    ShapeKind kind = ShapeKind::round;
    double radius = 0.0;  ///< round
    Eigen::Vector3d core =
        Eigen::Vector3d::Zero();            ///< round: from the centre to end 1 of the core
    std::array<Eigen::Vector3d, 3> axes{};  ///< box: unit
    Eigen::Vector3d half = Eigen::Vector3d::Zero();    ///< box: half extents along `axes`
    std::array<Eigen::Vector3d, 8> corners{};          ///< box: relative to the centre
    const LocalHull* hull = nullptr;                   ///< hull: outlives this
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the AABB
    Eigen::Vector3d bounds = Eigen::Vector3d::Zero();  ///< half extents of the AABB
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the body's origin to the centre
    double smallest = 0.0;                             ///< smallest half extent, metres

    /// Extent of the shape from its centre against a unit direction, metres.
    double drop(const Eigen::Vector3d& n) const {
        if (kind == ShapeKind::round) return radius + std::abs(dot(n, core));
        if (kind == ShapeKind::hull) return hull->drop(n);
        return std::abs(dot(n, axes[0])) * half[0] + std::abs(dot(n, axes[1])) * half[1] +
               std::abs(dot(n, axes[2])) * half[2];
    }
    /// The support point against a unit direction; on a tie the middle of the tied feature.
    DeepestPoint deepest(const Eigen::Vector3d& n) const;
    Eigen::Vector3d deepest_point(const Eigen::Vector3d& n) const { return deepest(n).point; }
    /// Corner of a box; bit i of the index is set on the positive side of axis i.
    Eigen::Vector3d corner(int index) const {
        return centre + corners[static_cast<std::size_t>(index)];
    }
    /// The face normal of a box along an axis, with the sign that makes z >= 0.
    Eigen::Vector3d up(std::size_t axis) const {
        return axes[axis][2] < 0.0 ? Eigen::Vector3d(-axes[axis]) : axes[axis];
    }
    /// The axis of a box that is most nearly parallel to a direction.
    std::size_t nearest_axis(const Eigen::Vector3d& n) const {
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < 3; ++i) {
            if (std::abs(dot(n, axes[i])) > std::abs(dot(n, axes[nearest]))) nearest = i;
        }
        return nearest;
    }
    /// Feature of a round shape at a point of its core: one of its ends, or its side.
    ShapeFeature core_feature(const Eigen::Vector3d& on_core) const;
    /// Whether a round shape is a capsule whose core is a segment.
    bool has_core() const { return dot(core, core) > 0.0; }
};

/// Calls `visitor(normal, drop)` for planes that bound a box or hull from below: all points p of the shape satisfy
/// normal . (p - centre) >= -drop, and the normal has z >= 0.
template <class Visitor>
void visit_down_planes(const LocalShape& shape, Visitor&& visitor) {
    if (shape.kind == ShapeKind::box) {
        for (std::size_t i = 0; i < 3; ++i) {
            visitor(shape.up(i), shape.half[static_cast<Eigen::Index>(i)]);
        }
    } else if (shape.kind == ShapeKind::hull) {
        for (std::size_t i = 0; i < shape.hull->plane_count; ++i) {
            visitor(shape.hull->planes[i].normal, shape.hull->planes[i].drop);
        }
    }
}

/// Makes a sphere, capsule, box or hull whose body origin is the origin of the local frame.
///
/// @param hull_out storage for a hull; outlives the result
template <class Convex>
LocalShape make_local_shape(const Convex& shape, const Eigen::Matrix3d& rotation,
                            LocalHull& hull_out);

/// The shape of a query in a local frame: one convex shape, or the parts of a compound, which are made on demand.
/// Cannot be copied or moved, because its shapes point into it.
class LocalBody {
public:
    LocalBody(const Shape& shape, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin);
    LocalBody(const LocalBody&) = delete;
    LocalBody& operator=(const LocalBody&) = delete;

    bool is_compound() const { return compound_ != nullptr; }
    /// The convex shape. For a compound only the centre, bounds and smallest half extent over all parts are set.
    const LocalShape& whole() const { return whole_; }
    /// @param hull_out storage, used if the part of a compound is a hull; outlives the result
    LocalShape part(std::uint32_t index, LocalHull& hull_out) const;

    /// Visits the parts whose bounds pass `wants`. A convex shape is always visited, as its own part 0.
    ///
    /// @param wants   bool(centre, half extents): whether to visit the parts inside this box
    /// @param visitor void(const LocalShape&, index of the part)
    template <class Wants, class Visitor>
    void visit(Wants&& wants, Visitor&& visitor) const {
        if (!is_compound()) {
            visitor(whole_, 0u);
            return;
        }
        visit_leaves(
            compound_->tree,
            [&](const Aabb& box) {
                const Eigen::Vector3d middle = 0.5 * (box.low + box.high);
                const Eigen::Vector3d half = box.high - middle;
                return wants(Eigen::Vector3d(origin_ + rotated(rotation_, middle)), around(half));
            },
            [&](std::uint32_t index) {
                LocalHull hull;
                visitor(part(index, hull), index);
            });
    }

private:
    /// Half extents along the world's axes of a box with half extents `half` along the body's axes.
    Eigen::Vector3d around(const Eigen::Vector3d& half) const;

    const CompoundData* compound_ = nullptr;
    Eigen::Matrix3d rotation_;
    Eigen::Vector3d origin_;
    LocalHull hull_;
    LocalShape whole_;
};

}  // namespace terrane::internal
