// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <limits>

// Vector products with a fixed order of operations: results are bit-identical with every version of Eigen and every
// vector width.
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

/// The product a b, column by column.
inline Eigen::Matrix3d product(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    Eigen::Matrix3d c;
    for (int column = 0; column < 3; ++column) c.col(column) = rotated(a, b.col(column));
    return c;
}

/// `m diag(d) m^T v`: applies a tensor that is diagonal in a body's axes to a world vector; `m` is world_from_body.
inline Eigen::Vector3d apply_tensor(const Eigen::Matrix3d& m, const Eigen::Vector3d& d,
                                    const Eigen::Vector3d& v) {
    const Eigen::Vector3d local = rotated_back(m, v);
    return rotated(m, {d.x() * local.x(), d.y() * local.y(), d.z() * local.z()});
}

/// A unit vector orthogonal to the unit vector `normal`; a pure function of the bits of `normal`.
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

/// Largest element of `m^T m` minus the identity, in absolute value; unspecified for NaN.
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

/// Tangent of an angle x, radians, |x| < pi / 2, accurate to a few units in the last place. Does not use libm, so that
/// the result's bits do not depend on the C library.
///
/// Source: J. H. Lambert, 1761 (its continued fraction).
inline double tangent(double x) {
    if (x == 0.0) return 0.0;
    double tail = 0.0;
    for (int odd = 41; odd >= 1; odd -= 2) tail = x * x / (static_cast<double>(odd) - tail);
    return tail / x;
}

/// Corners of a triangle, which may degenerate to a segment or a point.
using Corners = std::array<Eigen::Vector3d, 3>;

/// Upper bound of the distance from a point to a closed triangle, except for a relative rounding error of 2^-50;
/// bit-identical with every compiler. Let q be the ratio of the triangle's height to its longest edge. The bound
/// exceeds the distance by at most 2^-48 / q times the distance to a corner. If q < 1e-9, only edges are tested.
double distance_to_triangle(const Eigen::Vector3d& p, const Corners& triangle);

/// Half the extent of a box along a unit vector `axis`, which is given in the box's frame.
inline double reach_along(const Eigen::Vector3d& axis, const Eigen::Vector3d& half_extents) {
    return std::abs(axis[0]) * half_extents[0] + std::abs(axis[1]) * half_extents[1] +
           std::abs(axis[2]) * half_extents[2];
}

inline double norm1(const Eigen::Vector3d& v) {
    return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
}

}  // namespace terrane::internal
