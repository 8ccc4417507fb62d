// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

namespace terrane::internal {

/// Sum of squared distances to weighted planes (Garland and Heckbert 1997), as a function of a place: p' A p + 2 b'
/// p + c.
struct Quadric {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;  ///< A, symmetric
    double x = 0.0, y = 0.0, z = 0.0;                                   ///< b
    double constant = 0.0;                                              ///< c

    /// Adds `weight` times the squared distance to a plane.
    /// @param normal unit
    void add_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& on_plane, double weight) {
        const double a = normal[0], b = normal[1], c = normal[2], d = -dot(normal, on_plane);
        xx += weight * a * a;
        xy += weight * a * b;
        xz += weight * a * c;
        yy += weight * b * b;
        yz += weight * b * c;
        zz += weight * c * c;
        x += weight * a * d;
        y += weight * b * d;
        z += weight * c * d;
        constant += weight * d * d;
    }

    void add(const Quadric& o) {
        xx += o.xx;
        xy += o.xy;
        xz += o.xz;
        yy += o.yy;
        yz += o.yz;
        zz += o.zz;
        x += o.x;
        y += o.y;
        z += o.z;
        constant += o.constant;
    }

    /// Not negative, whatever the rounding.
    double at(const Eigen::Vector3d& p) const {
        const double sum = p[0] * (xx * p[0] + 2.0 * (xy * p[1] + xz * p[2] + x)) +
                           p[1] * (yy * p[1] + 2.0 * (yz * p[2] + y)) +
                           p[2] * (zz * p[2] + 2.0 * z) + constant;
        return sum > 0.0 ? sum : 0.0;
    }
};

}  // namespace terrane::internal
