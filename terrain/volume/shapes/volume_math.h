// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>

// Products with a fixed order of operations: results have the same bits with every version of Eigen.
namespace terrane::internal {

inline double dot_product(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Eigen::Vector3d cross_product(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Eigen::Vector3d rotate(const Eigen::Matrix3d& r, const Eigen::Vector3d& v) {
    return {r(0, 0) * v[0] + r(0, 1) * v[1] + r(0, 2) * v[2],
            r(1, 0) * v[0] + r(1, 1) * v[1] + r(1, 2) * v[2],
            r(2, 0) * v[0] + r(2, 1) * v[1] + r(2, 2) * v[2]};
}

/// The inverse of rotate() for an orthonormal matrix.
inline Eigen::Vector3d rotate_back(const Eigen::Matrix3d& r, const Eigen::Vector3d& v) {
    return {r(0, 0) * v[0] + r(1, 0) * v[1] + r(2, 0) * v[2],
            r(0, 1) * v[0] + r(1, 1) * v[1] + r(2, 1) * v[2],
            r(0, 2) * v[0] + r(1, 2) * v[1] + r(2, 2) * v[2]};
}

/// A box along the world's axes, metres.
struct WorldBox {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector3d high = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());

    void include(const Eigen::Vector3d& p, double radius) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis] - radius);
            high[axis] = std::max(high[axis], p[axis] + radius);
        }
    }
};

}  // namespace terrane::internal
