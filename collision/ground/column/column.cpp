// SPDX-License-Identifier: MIT
//
// Sources: C. Ericson. Real-time collision detection. 2005, sections 5.1.5 (point and triangle) and
//          5.1.9 (two segments).
// Deviations: all pairs of features are tested, because a bounding volume tree would be slower for the few pairs left
//             after culling.
#include "ground/column/column.h"

#include "base/vector_math.h"
#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

void keep_nearer(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& on_triangle,
                 ClosestPair& best) {
    const double distance = length(on_shape - on_triangle);
    if (distance < best.distance) best = {on_shape, on_triangle, distance};
}

// Replaces `best` by the closest points of the segments from p to p + u and from q to q + v, if these are nearer.
void visit_segments(const Eigen::Vector3d& p, const Eigen::Vector3d& u, const Eigen::Vector3d& q,
                    const Eigen::Vector3d& v, ClosestPair& best) {
    const SegmentParameters parameters = find_closest_parameters(p, u, q, v);
    keep_nearer(p + parameters.s * u, q + parameters.t * v, best);
}

// Intersection of a segment with a triangle; false if there is none.
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
    keep_nearer(from, closest_on_triangle(from, triangle), best);
    if (core[0] == 0.0 && core[1] == 0.0 && core[2] == 0.0) return best;
    const Eigen::Vector3d to = centre + core;
    keep_nearer(to, closest_on_triangle(to, triangle), best);
    Eigen::Vector3d crossing;
    if (crosses(from, to, triangle, crossing)) return {crossing, crossing, 0.0};
    for (std::size_t i = 0; i < 3; ++i) {
        visit_segments(from, 2.0 * core, triangle.v[i], triangle.v[(i + 1) % 3] - triangle.v[i],
                       best);
    }
    return best;
}

ClosestPair find_closest_box(const LocalShape& box, const Triangle& triangle) {
    ClosestPair best;
    best.distance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3d corner = box.corner(i);
        keep_nearer(corner, closest_on_triangle(corner, triangle), best);
    }
    for (const Eigen::Vector3d& v : triangle.v) {
        Eigen::Vector3d nearest = box.centre;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = box.axes[static_cast<std::size_t>(i)];
            nearest += std::clamp(dot(axis, v - box.centre), -box.half[i], box.half[i]) * axis;
        }
        keep_nearer(nearest, v, best);
    }
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = 2.0 * box.half[i] * box.axes[static_cast<std::size_t>(i)];
        for (int k = 0; k < 8; ++k) {
            if ((k >> i & 1) != 0) continue;
            const Eigen::Vector3d corner = box.corner(k);
            for (std::size_t j = 0; j < 3; ++j) {
                visit_segments(corner, edge, triangle.v[j], triangle.v[(j + 1) % 3] - triangle.v[j],
                               best);
            }
        }
    }
    return best;
}

// The support point of a sphere or capsule against a face's normal has the largest lift over the face's plane. If the
// support point lies over the face, its lift is the lift over the face. Otherwise the lift is largest over an edge or a
// corner of the face, and the lift over the plane is an upper bound.

namespace {

// Finds the s in [-1, 1] that maximises linear * s + reach * sqrt(square - (offset + rate * s)^2), among those for
// which the root is real. False if there is no such s.
bool find_round_maximum(double linear, double reach, double square, double offset, double rate,
                        double& s_out) {
    if (square < 0.0) return false;
    double first = -1.0;
    double last = 1.0;
    if (rate == 0.0) {
        if (offset * offset > square) return false;
        s_out = linear > 0.0 ? 1.0 : (linear < 0.0 ? -1.0 : 0.0);
        return true;
    }
    const double root = std::sqrt(square);
    first = std::max(first, std::min((-root - offset) / rate, (root - offset) / rate));
    last = std::min(last, std::max((-root - offset) / rate, (root - offset) / rate));
    if (first > last) return false;
    // With d = offset + rate s: maximise (linear / rate) d + reach sqrt(square - d^2).
    const double along = linear / rate;
    const double size = std::sqrt(along * along + reach * reach);
    const double d = size > 0.0 ? root * (along / size) : 0.0;
    s_out = std::clamp((d - offset) / rate, first, last);
    return true;
}

// Largest lift over the straight line through an edge that starts at `a`. `end_out` is -1 or 1 if that lift is attained
// beyond the first or second end of the edge, else 0.
double lift_over_edge(const LocalShape& shape, const Eigen::Vector3d& a,
                      const Eigen::Vector3d& edge, int& end_out) {
    const double run = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
    const Eigen::Vector3d along(edge[0] / run, edge[1] / run, 0.0);
    const Eigen::Vector3d out(along[1], -along[0], 0.0);
    const Eigen::Vector3d from = shape.centre - a;
    // The vertical plane through the edge cuts the shape in discs whose centres move along the core with s.
    const double grade = edge[2] / run;
    const double distance = dot(out, from);
    const double rate = dot(out, shape.core);
    const double rise = grade * dot(along, shape.core) - shape.core[2];
    const double reach = std::sqrt(grade * grade + 1.0);
    const double square = shape.radius * shape.radius;
    double s = 0.0;
    end_out = 0;
    if (!find_round_maximum(rise, reach, square, distance, rate, s)) return -kInfinity;
    const double d = distance + rate * s;
    const double r = std::sqrt(std::max(0.0, square - d * d));
    const double u = dot(along, from) + s * dot(along, shape.core) + r * grade / reach;
    if (u < 0.0) end_out = -1;
    if (u > run) end_out = 1;
    return grade * u - (from[2] + s * shape.core[2] - r / reach);
}

// Lift over one corner of a triangle.
double lift_over_corner(const LocalShape& shape, const Eigen::Vector3d& corner) {
    const Eigen::Vector3d from = shape.centre - corner;
    const double square = shape.radius * shape.radius;
    const double core_run =
        std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    double across = 0.0;
    double offset = 0.0;
    if (core_run > 0.0) {
        across = (from[0] * shape.core[1] - from[1] * shape.core[0]) / core_run;
        offset = (from[0] * shape.core[0] + from[1] * shape.core[1]) / core_run;
    } else {
        across = std::sqrt(from[0] * from[0] + from[1] * from[1]);
    }
    double s = 0.0;
    if (!find_round_maximum(-shape.core[2], 1.0, square - across * across, offset, core_run, s)) {
        return -kInfinity;
    }
    const double d = offset + core_run * s;
    const double r = std::sqrt(std::max(0.0, square - across * across - d * d));
    return -(from[2] + s * shape.core[2] - r);
}

}  // namespace

double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most) {
    double lift = -kInfinity;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& a = corners[i];
        const Eigen::Vector3d& b = corners[(i + 1) % 3];
        const Eigen::Vector3d edge = b - a;
        // Skips an edge if `most` lies on the inner side of it by more than rounding.
        const double slack = 1e-9 * (edge[0] * edge[0] + edge[1] * edge[1]);
        if (left_of(a, b, most) > slack) continue;
        int end = 0;
        const double over_edge = lift_over_edge(shape, a, edge, end);
        lift = std::max(lift, end == 0 ? over_edge : lift_over_corner(shape, end < 0 ? a : b));
    }
    return lift;
}

double compute_round_lift(const LocalShape& shape, const Triangle& triangle) {
    const TrianglePlane plane(triangle);
    double lift = -kInfinity;
    double highest = -kInfinity;
    Eigen::Vector3d most = shape.centre;
    for (const double s : {-1.0, 1.0}) {
        const Eigen::Vector3d lowest =
            shape.centre + s * shape.core - shape.radius * triangle.normal;
        const double above = plane.above(lowest);
        if (above > highest) {
            highest = above;
            most = lowest;
        }
        if (above > lift && is_over(lowest, triangle)) lift = above;
    }
    return lift < highest ? std::max(lift, lift_over_rim(shape, triangle.v, most)) : lift;
}

namespace {

double compute_box_lift(const LocalShape& box, const Triangle& triangle, double floor) {
    const TrianglePlane plane(triangle);
    const Eigen::Vector3d lowest = box.deepest_point(triangle.normal);
    if (is_over(lowest, triangle)) return plane.above(lowest);
    double lift = -kInfinity;
    // Vertical lines through the corners of the triangle, clipped by the slabs of the box.
    for (const Eigen::Vector3d& v : triangle.v) {
        double low = -kInfinity;
        double high = kInfinity;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = box.axes[static_cast<std::size_t>(i)];
            // the slab is |level + axis[2] * z| <= half, with z relative to v
            const double level = dot(axis, v - box.centre);
            if (axis[2] == 0.0) {
                if (std::abs(level) > box.half[i]) high = -kInfinity;
                continue;
            }
            const double z0 = (-box.half[i] - level) / axis[2];
            const double z1 = (box.half[i] - level) / axis[2];
            low = std::max(low, std::min(z0, z1));
            high = std::min(high, std::max(z0, z1));
        }
        if (low <= high) lift = std::max(lift, -low);
    }
    // Edges of the box's underside, clipped to the triangle in plan. An edge is deepest below the triangle's plane at
    // one of its ends: edges whose deeper end does not exceed the lift so far are skipped.
    std::array<double, 8> below;
    for (int k = 0; k < 8; ++k) below[static_cast<std::size_t>(k)] = plane.above(box.corner(k));
    for (int i = 0; i < 3; ++i) {
        const int j0 = (i + 1) % 3;
        const int j1 = (i + 2) % 3;
        for (int k = 0; k < 8; ++k) {
            if ((k >> i & 1) != 0) continue;
            const double at_from = below[static_cast<std::size_t>(k)];
            const double at_to = below[static_cast<std::size_t>(k | 1 << i)];
            if (!(std::max(at_from, at_to) > std::max(floor, lift))) continue;
            // An edge between two upward faces is not on the underside.
            const auto points_up = [&](int j) {
                const double z = box.axes[static_cast<std::size_t>(j)][2];
                return (k >> j & 1) != 0 ? z > 0.0 : z < 0.0;
            };
            if (points_up(j0) && points_up(j1)) continue;
            const Eigen::Vector3d from = box.corner(k);
            const Eigen::Vector3d to = box.corner(k | 1 << i);
            double first = 0.0;
            double last = 1.0;
            for (std::size_t j = 0; j < 3; ++j) {
                const double d0 = left_of(triangle.v[j], triangle.v[(j + 1) % 3], from);
                const double d1 = left_of(triangle.v[j], triangle.v[(j + 1) % 3], to);
                if (d0 < 0.0 && d1 < 0.0)
                    last = -1.0;
                else if (d0 < 0.0)
                    first = std::max(first, d0 / (d0 - d1));
                else if (d1 < 0.0)
                    last = std::min(last, d0 / (d0 - d1));
            }
            if (first > last) continue;
            const Eigen::Vector3d edge = 2.0 * box.half[i] * box.axes[static_cast<std::size_t>(i)];
            lift =
                std::max({lift, plane.above(from + first * edge), plane.above(from + last * edge)});
        }
    }
    return lift;
}

}  // namespace

bool find_direction(const ClosestPair& pair, Eigen::Vector3d& n_out) {
    // Below this distance the direction between the closest points is dominated by rounding.
    constexpr double kTiny = 1e-9;
    if (!(pair.distance > kTiny)) return false;
    const Eigen::Vector3d direction = (pair.on_shape - pair.on_triangle) / pair.distance;
    return direction[2] >= -kTiny && make_escape_direction(direction, n_out);
}

bool find_core_direction(const LocalShape& shape, const Triangle& triangle,
                         Eigen::Vector3d& n_out) {
    return find_direction(find_closest_core(shape.centre, shape.core, triangle), n_out);
}

Separation find_separation(const LocalShape& shape, const Triangle& triangle, bool with_walls) {
    Separation best;
    const auto offer = [&best](const Eigen::Vector3d& n, double gap) {
        if (gap > best.gap) best = {n, gap};
    };
    visit_tops(shape, triangle, offer);
    if (with_walls) visit_walls(shape, triangle, offer);
    return best;
}

double compute_column_lift(const LocalShape& shape, const Triangle& triangle, double floor) {
    if (shape.kind == ShapeKind::box) return compute_box_lift(shape, triangle, floor);
    if (shape.kind == ShapeKind::round) return compute_round_lift(shape, triangle);
    return compute_hull_lift(*shape.hull, shape.centre, triangle, floor);
}

}  // namespace terrane::internal
