// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/frame/local_ground.h"
#include "ground/frame/local_hull.h"
#include "pairs/kernels/core.h"

// A hull against one column: everything on or below a triangle.
namespace terrane::internal {

/// A hull as the core of the kernels in pairs/kernels.
///
/// @param centre of the hull's AABB
Core make_core(const LocalHull& hull, const Eigen::Vector3d& centre);

/// Lift of a hull over one triangle: see compute_column_lift().
///
/// Cost: a few supports
double compute_hull_lift(const LocalHull& hull, const Eigen::Vector3d& centre,
                         const Triangle& triangle, double floor);

/// Closest points of a hull and a triangle.
ClosestPair find_closest_hull(const LocalHull& hull, const Eigen::Vector3d& centre,
                              const Triangle& triangle);

/// Closest points of a hull and the column below a triangle.
ClosestPair find_closest_in_column(const LocalHull& hull, const Eigen::Vector3d& centre,
                                   const Triangle& triangle);

/// Visits the normals of edge-edge facets of the Minkowski difference of a hull and a column, for one edge of the
/// column: `take(unit normal, drop)`. Walks the hull's supports along the arc of the edge's normals.
///
/// @param along unit direction of the column's edge
/// @param first unit, where the arc of the normals of that edge begins
/// @param last  unit, where it ends, less than half a turn away
template <class Take>
void visit_meeting_edges(const LocalHull& hull, const Eigen::Vector3d& along,
                         const Eigen::Vector3d& first, const Eigen::Vector3d& last, Take&& take) {
    constexpr double kParallel = 1e-12;  // sine
    const Polyhedron& shape = *hull.shape;
    const Eigen::Vector3d d1 = hull.to_body(-first);
    const Eigen::Vector3d d2 = hull.to_body(-last);
    const auto cross_with = [&](const Eigen::Vector3d& edge_body, const Eigen::Vector3d& towards) {
        Eigen::Vector3d n = cross(along, rotated(hull.rotation, edge_body));
        const double size = length(n);
        if (!(size > kParallel * length(edge_body))) return;
        n /= size;
        if (dot(n, towards) < 0.0) n = -n;
        take(n, hull.drop(n));
    };
    std::uint32_t at = find_extreme(shape, d1);
    const auto edge_to = [&](std::uint32_t k) {
        return Eigen::Vector3d(shape.vertices[shape.neighbours[k]] - shape.vertices[at]);
    };
    // No step crosses edges that are level at the start of the arc.
    constexpr double kLevel = 1e-12;  // sine
    for (std::uint32_t k = shape.first_neighbour[at]; k < shape.first_neighbour[at + 1]; ++k) {
        const Eigen::Vector3d edge = edge_to(k);
        if (std::abs(dot(d1, edge)) <= kLevel * length(edge)) cross_with(edge, first);
    }
    // From the support vertex to the neighbour that becomes the support first.
    for (std::size_t step = 0; step < shape.vertices.size(); ++step) {
        double share = std::numeric_limits<double>::infinity();
        std::uint32_t next = at;
        Eigen::Vector3d passed = Eigen::Vector3d::Zero();
        for (std::uint32_t k = shape.first_neighbour[at]; k < shape.first_neighbour[at + 1]; ++k) {
            const Eigen::Vector3d edge = edge_to(k);
            const double at_last = dot(d2, edge);
            if (!(at_last > 0.0)) continue;
            const double at_first = dot(d1, edge);
            if (at_first > kLevel * length(edge)) continue;  // behind the arc, but for rounding
            const double when = at_first >= 0.0 ? 0.0 : at_first / (at_first - at_last);
            if (when < share) {
                share = when;
                next = shape.neighbours[k];
                passed = edge;
            }
        }
        if (next == at) return;
        cross_with(passed, (1.0 - share) * first + share * last);
        at = next;
    }
}

/// Outward normal of the column's wall below side i of its triangle: unit, level.
inline Eigen::Vector3d wall_normal(const Triangle& triangle, std::size_t i) {
    const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
    const double run = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
    return {edge[1] / run, -edge[0] / run, 0.0};
}

/// Visits the normals with z > 0 of the facets of the Minkowski difference of a hull and a column, except the
/// triangle's: `take(unit normal, drop)`.
template <class Take>
void visit_hull_tops(const LocalHull& hull, const Triangle& triangle, Take&& take) {
    constexpr double kLevel = 1e-12;
    for (const Polyhedron::Face& face : hull.shape->faces) {
        const Eigen::Vector3d& m = face.normal;
        const double down =
            hull.rotation(2, 0) * m[0] + hull.rotation(2, 1) * m[1] + hull.rotation(2, 2) * m[2];
        if (!(down < -kLevel)) continue;
        const Eigen::Vector3d n = -rotated(hull.rotation, m);
        take(n, face.offset + dot(n, hull.middle));
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        visit_meeting_edges(hull, edge / length(edge), triangle.normal, wall_normal(triangle, i),
                            [&](const Eigen::Vector3d& n, double drop) {
                                if (n[2] > kLevel) take(n, drop);
                            });
    }
}

/// The same for level normals.
template <class Take>
void visit_hull_walls(const LocalHull& hull, const Triangle& triangle, Take&& take) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d first = wall_normal(triangle, i);
        const Eigen::Vector3d last = wall_normal(triangle, (i + 1) % 3);
        take(first, hull.drop(first));
        // In two halves, because the arc at a sharp corner is nearly half a turn.
        const Eigen::Vector3d sum = first + last;
        const Eigen::Vector3d between = sum / length(sum);
        const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
        visit_meeting_edges(hull, up, first, between, take);
        visit_meeting_edges(hull, up, between, last, take);
    }
}

}  // namespace terrane::internal
