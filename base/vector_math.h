// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <limits>

// Products with a fixed order of operations: results have the same bits with every version of Eigen and every vector
// width.
namespace terrane::internal {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

/// The inverse of rotated() for an orthonormal matrix.
inline Eigen::Vector3d rotated_back(const Eigen::Matrix3d& m, const Eigen::Vector3d& v) {
    return {m(0, 0) * v.x() + m(1, 0) * v.y() + m(2, 0) * v.z(),
            m(0, 1) * v.x() + m(1, 1) * v.y() + m(2, 1) * v.z(),
            m(0, 2) * v.x() + m(1, 2) * v.y() + m(2, 2) * v.z()};
}

/// a b, column by column.
inline Eigen::Matrix3d product(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    Eigen::Matrix3d c;
    for (int column = 0; column < 3; ++column) c.col(column) = rotated(a, b.col(column));
    return c;
}

/// `m diag(d) m^T v`: a tensor that is diagonal in a body's axes, applied to a world vector.
inline Eigen::Vector3d apply_tensor(const Eigen::Matrix3d& m, const Eigen::Vector3d& d,
                                    const Eigen::Vector3d& v) {
    const Eigen::Vector3d local = rotated_back(m, v);
    return rotated(m, {d.x() * local.x(), d.y() * local.y(), d.z() * local.z()});
}

/// A unit vector orthogonal to a unit vector; a function of its bits.
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

/// Largest error of the products of a matrix's columns from those of an orthonormal one; unspecified for NaN.
inline double column_error(const Eigen::Matrix3d& m) {
    double worst = 0.0;
    for (int a = 0; a < 3; ++a) {
        for (int b = a; b < 3; ++b) {
            const double error = dot(m.col(a), m.col(b)) - (a == b ? 1.0 : 0.0);
            worst = worst < std::abs(error) ? std::abs(error) : worst;
        }
    }
    return worst;
}

inline double determinant(const Eigen::Matrix3d& m) {
    return dot(m.col(0), cross(m.col(1), m.col(2)));
}

inline bool is_finite(const Eigen::Vector3d& a) {
    return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

}  // namespace terrane::internal
