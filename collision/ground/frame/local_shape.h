// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_hull.h"

#include <terrane/collision/shapes.h>

#include <array>

namespace terrane::internal {

enum class ShapeKind {
    round,  ///< sphere or capsule: what is within a radius of a core
    box,
    hull,
};

/// Where a shape is deepest, and the feature that this is on.
struct DeepestPoint {
    Eigen::Vector3d point;
    ShapeFeature feature;
};

/// A convex shape in the axes of the world, placed in a local frame. A sphere is a capsule without a
/// core. All but hulls are symmetric about their centre.
struct LocalShape {
    ShapeKind kind = ShapeKind::round;
    double radius = 0.0;                               ///< round
    Eigen::Vector3d core = Eigen::Vector3d::Zero();    ///< round: from the centre to vertex 1
    std::array<Eigen::Vector3d, 3> axes{};             ///< box: unit
    Eigen::Vector3d half = Eigen::Vector3d::Zero();    ///< box: half extents along them
    std::array<Eigen::Vector3d, 8> corners{};          ///< box: from the centre
    const LocalHull* hull = nullptr;                   ///< hull: outlives this
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the bounding box
    Eigen::Vector3d bounds = Eigen::Vector3d::Zero();  ///< half extents of the bounding box
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< of the centre from the body's origin
    double smallest = 0.0;                             ///< half extent, metres

    /// How far it reaches from its centre against a unit direction: downwards, seen along it.
    double drop(const Eigen::Vector3d& n) const {
        if (kind == ShapeKind::round) return radius + std::abs(dot(n, core));
        if (kind == ShapeKind::hull) return hull->drop(n);
        return std::abs(dot(n, axes[0])) * half[0] + std::abs(dot(n, axes[1])) * half[1] +
               std::abs(dot(n, axes[2])) * half[2];
    }
    /// Its deepest point against a direction; on a tie the middle of the tied feature.
    DeepestPoint deepest(const Eigen::Vector3d& n) const;
    Eigen::Vector3d deepest_point(const Eigen::Vector3d& n) const { return deepest(n).point; }
    /// Of a box; bits of the index are the signs.
    Eigen::Vector3d corner(int index) const {
        return centre + corners[static_cast<std::size_t>(index)];
    }
    /// The normal of a box's face of one axis that looks up, or level.
    Eigen::Vector3d up(std::size_t axis) const {
        return axes[axis][2] < 0.0 ? Eigen::Vector3d(-axes[axis]) : axes[axis];
    }
    /// Of a round shape: whether a point of its core is one of its ends, or on its side.
    ShapeFeature core_feature(const Eigen::Vector3d& on_core) const;
    /// Whether a round shape has two ends.
    bool has_core() const { return dot(core, core) > 0.0; }
};

/// Visits planes that a shape with corners lies above, `take(normal, drop)`: its points p have
/// normal . (p - centre) >= -drop. None is steep to the point of being level.
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

/// A sphere, capsule, box or hull whose body's origin is the local frame's.
///
/// @param hull_out where the shape points to, if it is a hull
template <class Convex>
LocalShape make_local_shape(const Convex& shape, const Eigen::Matrix3d& rotation,
                            LocalHull& hull_out);

}  // namespace terrane::internal
