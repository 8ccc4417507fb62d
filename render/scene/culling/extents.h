// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cmath>

namespace terrane::internal {

/// Largest distance of a point of a box from its centre along an axis, both in the box's frame.
inline double reach_along(const Eigen::Vector3d& axis, const Eigen::Vector3d& half_extents) {
    return std::abs(axis[0]) * half_extents[0] + std::abs(axis[1]) * half_extents[1] +
           std::abs(axis[2]) * half_extents[2];
}

inline double norm1(const Eigen::Vector3d& v) {
    return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
}

}  // namespace terrane::internal
