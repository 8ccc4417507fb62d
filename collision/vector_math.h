// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cmath>

// Products with a fixed order of operations, so that no version of Eigen and no vector width changes
// a bit of a contact.
namespace terrane::internal {

inline double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double length(const Eigen::Vector3d& a) { return std::sqrt(dot(a, a)); }

inline Eigen::Vector3d rotated(const Eigen::Matrix3d& r, const Eigen::Vector3d& v) {
    return {r(0, 0) * v[0] + r(0, 1) * v[1] + r(0, 2) * v[2],
            r(1, 0) * v[0] + r(1, 1) * v[1] + r(1, 2) * v[2],
            r(2, 0) * v[0] + r(2, 1) * v[1] + r(2, 2) * v[2]};
}

inline bool is_finite(const Eigen::Vector3d& a) {
    return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

}  // namespace terrane::internal
