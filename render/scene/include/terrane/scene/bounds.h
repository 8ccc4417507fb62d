// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/aabb.h>
#include <terrane/terrain/bounding_sphere.h>
#include <terrane/terrain/math.h>

#include <span>

namespace terrane {

/// A box that contains an object, closed, with axes of its own.
struct OrientedBox {
    Pose frame_from_box;  ///< its origin is the middle of the box
    Eigen::Vector3d half_extents = Eigen::Vector3d::Zero();  ///< along the box's axes, metres, >= 0
};

/// The smallest box along the axes around points; with low = high = 0 for none.
Aabb bounding_box(std::span<const Eigen::Vector3d> points);

/// The box in the axes of another frame: contains all points of the box.
OrientedBox transform(const Pose& target_from_source, double scale, const Aabb& box_source);

/// The smallest box along the axes around an oriented box, up to rounding outward.
Aabb bounding_box(const OrientedBox& box);

/// The ball around the middle of a box through its corners, rounded outward.
BoundingSphere bounding_sphere(const OrientedBox& box);

}  // namespace terrane
