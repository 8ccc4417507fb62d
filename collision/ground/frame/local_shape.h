// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_hull.h"

#include <terrane/collision/shapes.h>

#include <array>

namespace terrane::internal {

enum class ShapeKind {
    round,  ///< sphere or capsule: all points within a radius of the core
    box,
    hull,
};

/// The point of a shape that is farthest against a direction, and its feature.
struct DeepestPoint {
    Eigen::Vector3d point;
    ShapeFeature feature;
};

/// A convex shape in a local frame, in world axes. A sphere is a capsule whose core is a point. All but hulls are
/// symmetric about their centre.
struct LocalShape {
    ShapeKind kind = ShapeKind::round;
    double radius = 0.0;  ///< round
    Eigen::Vector3d core =
        Eigen::Vector3d::Zero();            ///< round: from the centre to end 1 of the core
    std::array<Eigen::Vector3d, 3> axes{};  ///< box: unit
    Eigen::Vector3d half = Eigen::Vector3d::Zero();    ///< box: half extents along them
    std::array<Eigen::Vector3d, 8> corners{};          ///< box: from the centre
    const LocalHull* hull = nullptr;                   ///< hull: outlives this
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the AABB
    Eigen::Vector3d bounds = Eigen::Vector3d::Zero();  ///< half extents of the AABB
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the body's origin to the centre
    double smallest = 0.0;                             ///< smallest half extent, metres

    /// How far the shape reaches from its centre against a unit direction, metres.
    double drop(const Eigen::Vector3d& n) const {
        if (kind == ShapeKind::round) return radius + std::abs(dot(n, core));
        if (kind == ShapeKind::hull) return hull->drop(n);
        return std::abs(dot(n, axes[0])) * half[0] + std::abs(dot(n, axes[1])) * half[1] +
               std::abs(dot(n, axes[2])) * half[2];
    }
    /// The support point against a unit direction; on a tie the middle of the tied feature.
    DeepestPoint deepest(const Eigen::Vector3d& n) const;
    Eigen::Vector3d deepest_point(const Eigen::Vector3d& n) const { return deepest(n).point; }
    /// Corner of a box; bits of the index are the signs along the axes.
    Eigen::Vector3d corner(int index) const {
        return centre + corners[static_cast<std::size_t>(index)];
    }
    /// Of a box's two face normals along an axis, the one with z >= 0.
    Eigen::Vector3d up(std::size_t axis) const {
        return axes[axis][2] < 0.0 ? Eigen::Vector3d(-axes[axis]) : axes[axis];
    }
    /// The axis of a box that is nearest to parallel to a direction.
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

/// Visits planes that bound a box or hull from below, `take(normal, drop)`: its points p have
/// normal . (p - centre) >= -drop, and z of the normal is >= 0.
template <class Take>
void visit_down_planes(const LocalShape& shape, Take&& take) {
    if (shape.kind == ShapeKind::box) {
        for (std::size_t i = 0; i < 3; ++i) {
            take(shape.up(i), shape.half[static_cast<Eigen::Index>(i)]);
        }
    } else if (shape.kind == ShapeKind::hull) {
        for (std::size_t i = 0; i < shape.hull->plane_count; ++i) {
            take(shape.hull->planes[i].normal, shape.hull->planes[i].drop);
        }
    }
}

/// A sphere, capsule, box or hull whose body origin is the origin of the local frame.
///
/// @param hull_out storage for a hull; outlives the result
template <class Convex>
LocalShape make_local_shape(const Convex& shape, const Eigen::Matrix3d& rotation,
                            LocalHull& hull_out);

}  // namespace terrane::internal
