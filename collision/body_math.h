// SPDX-License-Identifier: MIT
#pragma once

#include "vector_math.h"

namespace terrane::internal {

/// The inverse of rotated() for an orthonormal matrix.
inline Eigen::Vector3d rotated_back(const Eigen::Matrix3d& m, const Eigen::Vector3d& v) {
    return {m(0, 0) * v.x() + m(1, 0) * v.y() + m(2, 0) * v.z(),
            m(0, 1) * v.x() + m(1, 1) * v.y() + m(2, 1) * v.z(),
            m(0, 2) * v.x() + m(1, 2) * v.y() + m(2, 2) * v.z()};
}

/// `m diag(d) m^T v`: a tensor that is diagonal in a body's axes, applied to a world vector.
inline Eigen::Vector3d apply_tensor(const Eigen::Matrix3d& m, const Eigen::Vector3d& d,
                                    const Eigen::Vector3d& v) {
    const Eigen::Vector3d local = rotated_back(m, v);
    return rotated(m, {d.x() * local.x(), d.y() * local.y(), d.z() * local.z()});
}

/// A unit vector square to a unit vector, the same for the same bits.
inline Eigen::Vector3d any_tangent(const Eigen::Vector3d& normal) {
    const double ax = std::abs(normal.x()), ay = std::abs(normal.y()), az = std::abs(normal.z());
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    if (ax <= ay && ax <= az) {
        axis = Eigen::Vector3d::UnitX();
    } else if (ay <= az) {
        axis = Eigen::Vector3d::UnitY();
    }
    const Eigen::Vector3d tangent = cross(normal, axis);
    return tangent / length(tangent);
}

}  // namespace terrane::internal
