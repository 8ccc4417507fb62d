// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

namespace terrane::internal {

/// A triangle's plane as a height over x and y.
struct TrianglePlane {
    explicit TrianglePlane(const Triangle& triangle)
        : a(triangle.v[0]),
          slope_x(-triangle.normal[0] / triangle.normal[2]),
          slope_y(-triangle.normal[1] / triangle.normal[2]) {}
    /// Height of the plane at (x, y) of a point minus the point's z, metres.
    double above(const Eigen::Vector3d& p) const {
        return slope_x * (p[0] - a[0]) + slope_y * (p[1] - a[1]) - (p[2] - a[2]);
    }
    Eigen::Vector3d a;
    double slope_x;
    double slope_y;
};

/// Twice the signed area of (a, b, p) seen from above: >= 0 to the left of a to b.
inline double left_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                      const Eigen::Vector3d& p) {
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

/// Whether a point lies over or below a triangle, seen from above.
inline bool is_over(const Eigen::Vector3d& p, const Triangle& triangle) {
    return left_of(triangle.v[0], triangle.v[1], p) >= 0.0 &&
           left_of(triangle.v[1], triangle.v[2], p) >= 0.0 &&
           left_of(triangle.v[2], triangle.v[0], p) >= 0.0;
}

}  // namespace terrane::internal
