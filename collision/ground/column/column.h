// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/column/hull_column.h"
#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <limits>

// A shape against one column: everything on or below a triangle. The ground is the union of its columns, which are
// convex.
namespace terrane::internal {

/// A separating plane of a shape and a column, or the one of least overlap.
struct Separation {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column, z >= 0
    double gap = -std::numeric_limits<double>::infinity();  ///< along it; negative: overlap
};

/// Gap between a shape and a column along a unit direction with z >= 0, metres; negative: overlap.
///
/// @param drop of the shape along the direction: LocalShape::drop()
inline double gap_along(const Eigen::Vector3d& n, double drop, const LocalShape& shape,
                        const Triangle& triangle) {
    // Relative to a corner, to avoid cancellation.
    const Eigen::Vector3d& a = triangle.v[0];
    const double top = std::max({0.0, dot(n, triangle.v[1] - a), dot(n, triangle.v[2] - a)});
    return dot(n, shape.centre - a) - drop - top;
}
inline double gap_along(const Eigen::Vector3d& n, const LocalShape& shape,
                        const Triangle& triangle) {
    return gap_along(n, shape.drop(n), shape, triangle);
}

/// A unit direction out of a column: `direction` with a negative z, which is rounding only, set to 0. False where
/// nothing is left.
inline bool make_escape_direction(const Eigen::Vector3d& direction, Eigen::Vector3d& n_out) {
    const Eigen::Vector3d out(direction[0], direction[1], std::max(0.0, direction[2]));
    const double size = length(out);
    if (!(size > 0.0)) return false;
    n_out = out / size;
    return true;
}

/// Visits an escape direction made perpendicular to each edge of the triangle: `take(unit direction)`.
template <class Take>
void visit_perpendicular_to_edges(const Triangle& triangle, const Eigen::Vector3d& direction,
                                  Take&& take) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        Eigen::Vector3d n;
        if (make_escape_direction(direction - (dot(direction, edge) / dot(edge, edge)) * edge, n))
            take(n);
    }
}

/// Visits the candidate separating axes of a shape and a column: `take(normal, gap)`. visit_tops() those with z > 0,
/// visit_walls() the level ones.
///
/// For boxes and hulls the largest gap over both is that of the separating axis theorem: positive exactly where they
/// are apart, else minus the length of the minimum translation. For a sphere or capsule whose core is apart from the
/// triangle, one of them is the exact distance.
template <class Take>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Take&& take);
template <class Take>
void visit_walls(const LocalShape& shape, const Triangle& triangle, Take&& take);

/// The axis of the largest gap; level axes count only `with_walls`.
Separation find_separation(const LocalShape& shape, const Triangle& triangle, bool with_walls);

/// Lift of a shape over one column: largest of triangle height minus z over the points of the shape that lie over or
/// below the triangle, metres; minus infinity where there are none. Exact: feature pairs in closed form, or a facet
/// that proves it. Lifts up to `floor` may be returned as minus infinity.
double compute_column_lift(const LocalShape& shape, const Triangle& triangle,
                           double floor = -std::numeric_limits<double>::infinity());

/// An upper bound of compute_column_lift(), from the planes that bound the shape from below.
inline double bound_column_lift(const LocalShape& shape, const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    double bound = (shape.drop(n) - dot(n, shape.centre - triangle.v[0])) / n[2];
    if (shape.kind == ShapeKind::round) return bound;
    if (shape.kind == ShapeKind::hull) {
        // The planes of its faces bounded the whole cell already.
        return bound + 1e-12 * (1.0 + std::abs(bound));
    }
    constexpr double kSteep = 1e-3;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d up = shape.up(i);
        if (up[2] < kSteep) continue;
        double highest = -std::numeric_limits<double>::infinity();
        for (const Eigen::Vector3d& v : triangle.v)
            highest = std::max(highest, dot(up, v - shape.centre));
        bound = std::min(bound, (highest + shape.half[static_cast<Eigen::Index>(i)]) / up[2]);
    }
    return bound + 1e-12 * (1.0 + std::abs(bound));  // for rounding
}

/// The escape direction between two closest points; false where they are too near to tell it, or it points down.
bool find_direction(const ClosestPair& pair, Eigen::Vector3d& n_out);
/// The same from a triangle to the core of a round shape.
bool find_core_direction(const LocalShape& shape, const Triangle& triangle, Eigen::Vector3d& n_out);

template <class Take>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Take&& take) {
    take(triangle.normal, gap_along(triangle.normal, shape, triangle));
    const auto take_upward = [&](Eigen::Vector3d n) {
        // Nearly parallel edges have no axis of their own; nearly level axes belong to visit_walls().
        constexpr double kTiny = 1e-12;
        const double size = length(n);
        if (!(size > kTiny)) return;
        n /= n[2] < 0.0 ? -size : size;
        if (n[2] > kTiny) take(n, gap_along(n, shape, triangle));
    };
    if (shape.kind == ShapeKind::hull) {
        visit_hull_tops(*shape.hull, triangle, [&](const Eigen::Vector3d& n, double drop) {
            take(n, gap_along(n, drop, shape, triangle));
        });
        return;
    }
    if (shape.kind == ShapeKind::round) {
        Eigen::Vector3d n;
        if (find_core_direction(shape, triangle, n)) {
            take(n, gap_along(n, shape, triangle));
            return;
        }
        if (!shape.has_core()) return;
        const Eigen::Vector3d axis = shape.core / length(shape.core);
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
            take_upward(cross(axis, edge / length(edge)));
        }
        return;
    }
    for (const Eigen::Vector3d& axis : shape.axes) take_upward(axis);
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const Eigen::Vector3d direction = edge / length(edge);
        for (const Eigen::Vector3d& axis : shape.axes) take_upward(cross(axis, direction));
    }
}

template <class Take>
void visit_walls(const LocalShape& shape, const Triangle& triangle, Take&& take) {
    if (shape.kind == ShapeKind::hull) {
        visit_hull_walls(*shape.hull, triangle, [&](const Eigen::Vector3d& n, double drop) {
            take(n, gap_along(n, drop, shape, triangle));
        });
        return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const double size = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
        const Eigen::Vector3d n(edge[1] / size, -edge[0] / size, 0.0);
        take(n, gap_along(n, shape, triangle));
    }
    const auto take_sides = [&](const Eigen::Vector3d& along) {
        constexpr double kTiny = 1e-12;
        const double size = std::sqrt(along[0] * along[0] + along[1] * along[1]);
        if (!(size > kTiny)) return;
        const Eigen::Vector3d n(along[1] / size, -along[0] / size, 0.0);
        take(n, gap_along(n, shape, triangle));
        take(-n, gap_along(-n, shape, triangle));
    };
    if (shape.kind == ShapeKind::box) {
        for (const Eigen::Vector3d& axis : shape.axes) take_sides(axis);
        return;
    }
    take_sides(shape.core);
    // From the column's vertical edges to the core's ends, seen from above.
    for (const double sign : {-1.0, 1.0}) {
        for (const Eigen::Vector3d& v : triangle.v) {
            const Eigen::Vector3d to = shape.centre + sign * shape.core - v;
            take_sides(Eigen::Vector3d(-to[1], to[0], 0.0));
        }
    }
    // From the corners to the inside of the core the axis is perpendicular to the core: visited above.
}

}  // namespace terrane::internal
