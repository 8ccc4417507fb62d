// SPDX-License-Identifier: MIT
// Sources: C. Ericson. Real-time collision detection. 2005, sections 5.1.5 (point and triangle) and
//          5.1.9 (two segments).
// Deviations: all pairs of features are tested; a bounding volume tree would be slower for the few pairs that are left
//             after pruning.
#include "ground/column/closest_points.h"

#include "ground/frame/local_shape.h"

#include <algorithm>
#include <limits>

namespace terrane::internal {
namespace {

void take_nearer(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& on_triangle,
                 ClosestPair& best) {
    const double distance = length(on_shape - on_triangle);
    if (distance < best.distance) best = {on_shape, on_triangle, distance};
}

// The closest points of the segments p to p + u and q to q + v.
void take_segments(const Eigen::Vector3d& p, const Eigen::Vector3d& u, const Eigen::Vector3d& q,
                   const Eigen::Vector3d& v, ClosestPair& best) {
    const SegmentParameters parameters = find_closest_parameters(p, u, q, v);
    take_nearer(p + parameters.s * u, q + parameters.t * v, best);
}

// Where a segment intersects a triangle; false where it does not.
bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Triangle& triangle,
             Eigen::Vector3d& point_out) {
    const double d0 = dot(triangle.normal, from - triangle.v[0]);
    const double d1 = dot(triangle.normal, to - triangle.v[0]);
    if ((d0 > 0.0) == (d1 > 0.0)) return false;
    point_out = from + (d0 / (d0 - d1)) * (to - from);
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        if (dot(cross(edge, point_out - triangle.v[i]), triangle.normal) < 0.0) return false;
    }
    return true;
}

}  // namespace

SegmentParameters find_closest_parameters(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                          const Eigen::Vector3d& q, const Eigen::Vector3d& v) {
    const Eigen::Vector3d r = p - q;
    const double a = dot(u, u);
    const double e = dot(v, v);
    const double f = dot(v, r);
    double s = 0.0;
    double t = 0.0;
    if (a == 0.0) {
        t = std::clamp(f / e, 0.0, 1.0);
    } else {
        const double c = dot(u, r);
        const double b = dot(u, v);
        const double denominator = a * e - b * b;
        if (denominator > 0.0) s = std::clamp((b * f - c * e) / denominator, 0.0, 1.0);
        t = (b * s + f) / e;
        if (t < 0.0) {
            t = 0.0;
            s = std::clamp(-c / a, 0.0, 1.0);
        } else if (t > 1.0) {
            t = 1.0;
            s = std::clamp((b - c) / a, 0.0, 1.0);
        }
    }
    return {s, t};
}

Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Triangle& triangle) {
    const Eigen::Vector3d& a = triangle.v[0];
    const Eigen::Vector3d& b = triangle.v[1];
    const Eigen::Vector3d& c = triangle.v[2];
    const Eigen::Vector3d ab = b - a;
    const Eigen::Vector3d ac = c - a;
    const Eigen::Vector3d ap = p - a;
    const double d1 = dot(ab, ap);
    const double d2 = dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    const Eigen::Vector3d bp = p - b;
    const double d3 = dot(ab, bp);
    const double d4 = dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + (d1 / (d1 - d3)) * ab;
    const Eigen::Vector3d cp = p - c;
    const double d5 = dot(ab, cp);
    const double d6 = dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + (d2 / (d2 - d6)) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
    }
    return p - dot(triangle.normal, ap) * triangle.normal;
}

ClosestPair find_closest_core(const Eigen::Vector3d& centre, const Eigen::Vector3d& core,
                              const Triangle& triangle) {
    ClosestPair best;
    best.distance = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d from = centre - core;
    take_nearer(from, closest_on_triangle(from, triangle), best);
    if (core[0] == 0.0 && core[1] == 0.0 && core[2] == 0.0) return best;
    const Eigen::Vector3d to = centre + core;
    take_nearer(to, closest_on_triangle(to, triangle), best);
    Eigen::Vector3d crossing;
    if (crosses(from, to, triangle, crossing)) return {crossing, crossing, 0.0};
    for (std::size_t i = 0; i < 3; ++i) {
        take_segments(from, 2.0 * core, triangle.v[i], triangle.v[(i + 1) % 3] - triangle.v[i],
                      best);
    }
    return best;
}

ClosestPair find_closest_box(const LocalShape& box, const Triangle& triangle) {
    ClosestPair best;
    best.distance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3d corner = box.corner(i);
        take_nearer(corner, closest_on_triangle(corner, triangle), best);
    }
    for (const Eigen::Vector3d& v : triangle.v) {
        Eigen::Vector3d nearest = box.centre;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = box.axes[static_cast<std::size_t>(i)];
            nearest += std::clamp(dot(axis, v - box.centre), -box.half[i], box.half[i]) * axis;
        }
        take_nearer(nearest, v, best);
    }
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = 2.0 * box.half[i] * box.axes[static_cast<std::size_t>(i)];
        for (int k = 0; k < 8; ++k) {
            if ((k >> i & 1) != 0) continue;
            const Eigen::Vector3d corner = box.corner(k);
            for (std::size_t j = 0; j < 3; ++j) {
                take_segments(corner, edge, triangle.v[j], triangle.v[(j + 1) % 3] - triangle.v[j],
                              best);
            }
        }
    }
    return best;
}

}  // namespace terrane::internal
