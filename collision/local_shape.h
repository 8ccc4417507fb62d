// SPDX-License-Identifier: MIT
#pragma once

#include "vector_math.h"

#include <terrane/collision/shapes.h>

#include <array>

namespace terrane::internal {

/// A shape in the axes of the world, its centre in a local frame. A sphere is a capsule without a
/// core. All are symmetric about their centre.
struct LocalShape {
    bool is_box = false;
    double radius = 0.0;                             ///< sphere, capsule
    Eigen::Vector3d core = Eigen::Vector3d::Zero();  ///< from the centre to one end of the core
    std::array<Eigen::Vector3d, 3> axes{};           ///< box: unit
    Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< box: half extents along them
    std::array<Eigen::Vector3d, 8> corners{};        ///< box: from the centre
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Vector3d bounds = Eigen::Vector3d::Zero();  ///< half extents of the bounding box
    double smallest = 0.0;                             ///< half extent, metres

    /// How far it reaches from its centre along a unit direction.
    double extent(const Eigen::Vector3d& n) const {
        if (!is_box) return radius + std::abs(dot(n, core));
        return std::abs(dot(n, axes[0])) * half[0] + std::abs(dot(n, axes[1])) * half[1] +
               std::abs(dot(n, axes[2])) * half[2];
    }
    /// Its deepest point against a direction; on a tie the middle of the tied feature.
    Eigen::Vector3d deepest_point(const Eigen::Vector3d& n) const;
    /// Of a box; bits of the index are the signs.
    Eigen::Vector3d corner(int index) const {
        return centre + corners[static_cast<std::size_t>(index)];
    }
    /// The normal of a box's face of one axis that looks up, or level.
    Eigen::Vector3d up(std::size_t axis) const {
        return axes[axis][2] < 0.0 ? Eigen::Vector3d(-axes[axis]) : axes[axis];
    }
};

LocalShape make_local_shape(const Shape& shape, const Eigen::Matrix3d& rotation);

/// Whether check(shape) passes, the pose is finite, and the rotation orthonormal to 1e-6.
bool is_usable(const Shape& shape, const Pose& pose);

}  // namespace terrane::internal
