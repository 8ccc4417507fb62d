// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/column/hull_column.h"
#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <limits>

// A shape against one column: everything on or below a triangle. The ground is the union of its
// columns, and each is convex.
namespace terrane::internal {

/// A plane between a shape and a column.
struct Separation {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column, z >= 0
    double gap = -std::numeric_limits<double>::infinity();  ///< along it; negative: overlap
};

/// How far a shape is from a column along a unit direction with z >= 0; negative: overlap.
///
/// @param drop how far the shape reaches from its centre against the direction
inline double gap_along(const Eigen::Vector3d& n, double drop, const LocalShape& shape,
                        const Triangle& triangle) {
    // Relative to a corner, so that nothing large cancels.
    const Eigen::Vector3d& a = triangle.v[0];
    const double top = std::max({0.0, dot(n, triangle.v[1] - a), dot(n, triangle.v[2] - a)});
    return dot(n, shape.centre - a) - drop - top;
}
inline double gap_along(const Eigen::Vector3d& n, const LocalShape& shape,
                        const Triangle& triangle) {
    return gap_along(n, shape.drop(n), shape, triangle);
}

/// Visits the directions that can separate a shape from a column: `take(normal, gap)`.
///
/// For boxes and hulls the largest gap is that of the separating axis theorem: positive exactly where
/// they are apart, minus the shortest translation that parts them where they overlap. For swept cores
/// one of them is the exact distance where the core lies apart from the triangle.
/// A direction out of a column, unit: no direction leads down but by rounding. False where there is none.
inline bool make_escape_direction(const Eigen::Vector3d& direction, Eigen::Vector3d& n_out) {
    const Eigen::Vector3d out(direction[0], direction[1], std::max(0.0, direction[2]));
    const double size = length(out);
    if (!(size > 0.0)) return false;
    n_out = out / size;
    return true;
}

/// A direction out of a column made square to each of its upper edges, where it may start from one.
template <class Take>
void visit_perpendicular_to_edges(const Triangle& triangle, const Eigen::Vector3d& direction, Take&& take) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        Eigen::Vector3d n;
        if (make_escape_direction(direction - (dot(direction, edge) / dot(edge, edge)) * edge, n)) take(n);
    }
}

template <class Take>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Take&& take);
template <class Take>
void visit_walls(const LocalShape& shape, const Triangle& triangle, Take&& take);

/// The direction of the largest gap; `with_walls` also looks sideways.
Separation find_separation(const LocalShape& shape, const Triangle& triangle, bool with_walls);

/// Largest of triangle height minus z over the points of a shape that lie over or below a triangle;
/// minus infinity where there are none. Exact: every feature pair in closed form, or a facet that
/// proves it. Lifts up to `floor` may come back as minus infinity.
double compute_column_lift(const LocalShape& shape, const Triangle& triangle,
                           double floor = -std::numeric_limits<double>::infinity());

/// An upper bound of the same: each side of the shape that looks down bounds it alone.
inline double bound_column_lift(const LocalShape& shape, const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    double bound = (shape.drop(n) - dot(n, shape.centre - triangle.v[0])) / n[2];
    if (shape.kind == ShapeKind::round) return bound;
    if (shape.kind == ShapeKind::hull) {
        // Its other sides bounded the whole cell.
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
    return bound + 1e-12 * (1.0 + std::abs(bound));  // what rounding does to it
}

/// The direction from a triangle to a core, where they are apart and it looks up or sideways.
bool find_direction(const ClosestPair& pair, Eigen::Vector3d& n_out);
bool find_core_direction(const LocalShape& shape, const Triangle& triangle, Eigen::Vector3d& n_out);

template <class Take>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Take&& take) {
    take(triangle.normal, gap_along(triangle.normal, shape, triangle));
    const auto take_upward = [&](Eigen::Vector3d n) {
        // Nearly parallel edges give no direction of their own, nearly level ones are a wall's.
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
    // The corners of the column, seen from the core's ends in the plane.
    for (const double sign : {-1.0, 1.0}) {
        for (const Eigen::Vector3d& v : triangle.v) {
            const Eigen::Vector3d to = shape.centre + sign * shape.core - v;
            take_sides(Eigen::Vector3d(-to[1], to[0], 0.0));
        }
    }
    // The core's inside, seen from the corners, is square to the core: taken above.
}

}  // namespace terrane::internal
