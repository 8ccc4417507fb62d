// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"
#include "pairs/convex_core.h"

#include <array>
#include <limits>

namespace terrane::internal {

struct LocalShape;

/// The closest points of a shape and a triangle. If they intersect, the distance is 0 and the points are arbitrary.
struct ClosestPair {
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d on_triangle = Eigen::Vector3d::Zero();
    double distance = 0.0;
};

/// Parameters of the closest points of two segments p + s u and q + t v, in [0, 1].
struct SegmentParameters {
    double s = 0.0;
    double t = 0.0;
};

/// Closest points of the segments from p to p + u and from q to q + v. v must not be zero; u may be. For parallel
/// segments any closest pair is returned.
SegmentParameters find_closest_parameters(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                          const Eigen::Vector3d& q, const Eigen::Vector3d& v);

/// The point of a triangle that is closest to p.
Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Triangle& triangle);

/// Closest points of a triangle and the segment from `centre - core` to `centre + core`.
ClosestPair find_closest_core(const Eigen::Vector3d& centre, const Eigen::Vector3d& core,
                              const Triangle& triangle);

/// Closest points of a box and a triangle that do not intersect.
ClosestPair find_closest_box(const LocalShape& box, const Triangle& triangle);

// A sphere or capsule against one column: everything on or below a triangle.

/// The lift of a sphere or capsule over one triangle: see compute_column_lift().
double compute_round_lift(const LocalShape& shape, const Triangle& triangle);

/// Lift over a triangle if the lift over the triangle's whole plane is largest at a point outside. The lift is concave
/// in x and y: its maximum over the triangle is on an edge that separates the triangle from that point.
///
/// @param most that point; only x and y are used
double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most);

// A hull against one column: everything on or below a triangle.

/// A hull as a convex core (pairs/convex_core.h).
///
/// @param centre of the hull's AABB
Core make_core(const LocalHull& hull, const Eigen::Vector3d& centre);

/// Lift of a hull over one triangle: see compute_column_lift().
///
/// Cost: a few searches for a support point
double compute_hull_lift(const LocalHull& hull, const Eigen::Vector3d& centre,
                         const Triangle& triangle, double floor);

/// Closest points of a hull and a triangle.
ClosestPair find_closest_hull(const LocalHull& hull, const Eigen::Vector3d& centre,
                              const Triangle& triangle);

/// Closest points of a hull and the column below a triangle.
ClosestPair find_closest_in_column(const LocalHull& hull, const Eigen::Vector3d& centre,
                                   const Triangle& triangle);

/// Calls `visitor(unit normal, drop)` for the facets of the Minkowski difference of a hull and a column that a given
/// edge of the column forms with edges of the hull. Follows the hull's support vertex along the arc of that edge's
/// normals.
///
/// @param along unit direction of the column's edge
/// @param first unit, start of the arc of the edge's normals
/// @param last  unit, end of the arc, less than half a turn away
template <class Visitor>
void visit_meeting_edges(const LocalHull& hull, const Eigen::Vector3d& along,
                         const Eigen::Vector3d& first, const Eigen::Vector3d& last,
                         Visitor&& visitor) {
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
        visitor(n, hull.drop(n));
    };
    std::uint32_t at = find_extreme(shape, d1);
    const auto edge_to = [&](std::uint32_t k) {
        return Eigen::Vector3d(shape.vertices[shape.neighbours[k]] - shape.vertices[at]);
    };
    // Edges of the hull perpendicular to the start of the arc: the steps below may not cross them.
    constexpr double kLevel = 1e-12;  // sine
    for (std::uint32_t k = shape.first_neighbour[at]; k < shape.first_neighbour[at + 1]; ++k) {
        const Eigen::Vector3d edge = edge_to(k);
        if (std::abs(dot(d1, edge)) <= kLevel * length(edge)) cross_with(edge, first);
    }
    // Each step goes from the support vertex to the neighbour that becomes the next support vertex.
    for (std::size_t step = 0; step < shape.vertices.size(); ++step) {
        double share = std::numeric_limits<double>::infinity();
        std::uint32_t next = at;
        Eigen::Vector3d passed = Eigen::Vector3d::Zero();
        for (std::uint32_t k = shape.first_neighbour[at]; k < shape.first_neighbour[at + 1]; ++k) {
            const Eigen::Vector3d edge = edge_to(k);
            const double at_last = dot(d2, edge);
            if (!(at_last > 0.0)) continue;
            const double at_first = dot(d1, edge);
            if (at_first > kLevel * length(edge)) continue;  // behind the arc, up to rounding
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

/// Outward normal of the column's wall below side i of its triangle: unit, horizontal.
inline Eigen::Vector3d wall_normal(const Triangle& triangle, std::size_t i) {
    const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
    const double run = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
    return {edge[1] / run, -edge[0] / run, 0.0};
}

/// Calls `visitor(unit normal, drop)` for each facet of the Minkowski difference of a hull and a column whose normal
/// has z > 0. The facet of the triangle itself is omitted.
template <class Visitor>
void visit_hull_tops(const LocalHull& hull, const Triangle& triangle, Visitor&& visitor) {
    constexpr double kLevel = 1e-12;
    for (const Polyhedron::Face& face : hull.shape->faces) {
        const Eigen::Vector3d& m = face.normal;
        const double down =
            hull.rotation(2, 0) * m[0] + hull.rotation(2, 1) * m[1] + hull.rotation(2, 2) * m[2];
        if (!(down < -kLevel)) continue;
        const Eigen::Vector3d n = -rotated(hull.rotation, m);
        visitor(n, face.offset + dot(n, hull.middle));
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        visit_meeting_edges(hull, edge / length(edge), triangle.normal, wall_normal(triangle, i),
                            [&](const Eigen::Vector3d& n, double drop) {
                                if (n[2] > kLevel) visitor(n, drop);
                            });
    }
}

/// Calls `visitor(unit normal, drop)` for each facet of the same Minkowski difference whose normal is horizontal.
template <class Visitor>
void visit_hull_walls(const LocalHull& hull, const Triangle& triangle, Visitor&& visitor) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d first = wall_normal(triangle, i);
        const Eigen::Vector3d last = wall_normal(triangle, (i + 1) % 3);
        visitor(first, hull.drop(first));
        // Split in two, because at a sharp corner the arc is nearly half a turn.
        const Eigen::Vector3d sum = first + last;
        const Eigen::Vector3d between = sum / length(sum);
        const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
        visit_meeting_edges(hull, up, first, between, visitor);
        visit_meeting_edges(hull, up, between, last, visitor);
    }
}

// A shape against one column: everything on or below a triangle. The ground is the union of its columns, which are
// convex.

/// A separating plane of a shape and a column, or the plane of smallest overlap.
struct Separation {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column, z >= 0
    double gap = -std::numeric_limits<double>::infinity();  ///< along `normal`; negative: overlap
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

/// Makes an escape direction, a unit direction that leads out of a column, from `direction`: a negative z, which is due
/// to rounding, becomes 0. False if the result is the zero vector.
inline bool make_escape_direction(const Eigen::Vector3d& direction, Eigen::Vector3d& n_out) {
    const Eigen::Vector3d out(direction[0], direction[1], std::max(0.0, direction[2]));
    const double size = length(out);
    if (!(size > 0.0)) return false;
    n_out = out / size;
    return true;
}

/// Calls `visitor(unit direction)` with the part of an escape direction perpendicular to each edge of the triangle.
template <class Visitor>
void visit_perpendicular_to_edges(const Triangle& triangle, const Eigen::Vector3d& direction,
                                  Visitor&& visitor) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        Eigen::Vector3d n;
        if (make_escape_direction(direction - (dot(direction, edge) / dot(edge, edge)) * edge, n))
            visitor(n);
    }
}

// The separating axes of boxes:
// Sources: S. Gottschalk, M. Lin, D. Manocha. OBBTree. SIGGRAPH 1996 (separating axes).
// Deviations: a column has no bottom: only axes with z >= 0 count. Its vertical edges add the cross products of the
//             vertical with the edges of the box.

/// Call `visitor(normal, gap)` for candidate separating axes of a shape and a column: visit_tops() for those with
/// positive z, visit_walls() for the horizontal ones.
///
/// For boxes and hulls the two functions together visit all axes of the separating axis theorem: the largest gap is
/// positive if and only if shape and column are disjoint; otherwise it is minus the length of the minimum translation.
/// For a sphere or capsule whose core does not touch the triangle, one of the gaps is the exact distance.
template <class Visitor>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Visitor&& visitor);
template <class Visitor>
void visit_walls(const LocalShape& shape, const Triangle& triangle, Visitor&& visitor);

/// Finds the axis with the largest gap. Horizontal axes are tested only if `with_walls`.
Separation find_separation(const LocalShape& shape, const Triangle& triangle, bool with_walls);

/// Lift of a shape over one column: the maximum of triangle height minus z over the points of the shape that lie above
/// or below the triangle, metres; minus infinity if there are none. Exact: computed from pairs of features in closed
/// form or, for hulls, from a facet of the Minkowski difference. A lift of at most `floor` may be returned as minus
/// infinity.
double compute_column_lift(const LocalShape& shape, const Triangle& triangle,
                           double floor = -std::numeric_limits<double>::infinity());

/// An upper bound of compute_column_lift(), from the planes that bound the shape from below.
inline double bound_column_lift(const LocalShape& shape, const Triangle& triangle) {
    const Eigen::Vector3d& n = triangle.normal;
    double bound = (shape.drop(n) - dot(n, shape.centre - triangle.v[0])) / n[2];
    if (shape.kind == ShapeKind::round) return bound;
    if (shape.kind == ShapeKind::hull) {
        // The caller has tested the planes of the hull's faces for the whole cell already.
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

/// The escape direction from the triangle to the shape. False if the points are too close together or it points down.
bool find_direction(const ClosestPair& pair, Eigen::Vector3d& n_out);
/// The escape direction from a triangle to the core of a round shape; false as find_direction().
bool find_core_direction(const LocalShape& shape, const Triangle& triangle, Eigen::Vector3d& n_out);

template <class Visitor>
void visit_tops(const LocalShape& shape, const Triangle& triangle, Visitor&& visitor) {
    visitor(triangle.normal, gap_along(triangle.normal, shape, triangle));
    const auto visit_upward = [&](Eigen::Vector3d n) {
        // Nearly parallel edges give no further axis; nearly horizontal axes belong to visit_walls().
        constexpr double kTiny = 1e-12;
        const double size = length(n);
        if (!(size > kTiny)) return;
        n /= n[2] < 0.0 ? -size : size;
        if (n[2] > kTiny) visitor(n, gap_along(n, shape, triangle));
    };
    if (shape.kind == ShapeKind::hull) {
        visit_hull_tops(*shape.hull, triangle, [&](const Eigen::Vector3d& n, double drop) {
            visitor(n, gap_along(n, drop, shape, triangle));
        });
        return;
    }
    if (shape.kind == ShapeKind::round) {
        Eigen::Vector3d n;
        if (find_core_direction(shape, triangle, n)) {
            visitor(n, gap_along(n, shape, triangle));
            return;
        }
        if (!shape.has_core()) return;
        const Eigen::Vector3d axis = shape.core / length(shape.core);
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
            visit_upward(cross(axis, edge / length(edge)));
        }
        return;
    }
    for (const Eigen::Vector3d& axis : shape.axes) visit_upward(axis);
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const Eigen::Vector3d direction = edge / length(edge);
        for (const Eigen::Vector3d& axis : shape.axes) visit_upward(cross(axis, direction));
    }
}

template <class Visitor>
void visit_walls(const LocalShape& shape, const Triangle& triangle, Visitor&& visitor) {
    if (shape.kind == ShapeKind::hull) {
        visit_hull_walls(*shape.hull, triangle, [&](const Eigen::Vector3d& n, double drop) {
            visitor(n, gap_along(n, drop, shape, triangle));
        });
        return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const double size = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
        const Eigen::Vector3d n(edge[1] / size, -edge[0] / size, 0.0);
        visitor(n, gap_along(n, shape, triangle));
    }
    const auto visit_sides = [&](const Eigen::Vector3d& along) {
        constexpr double kTiny = 1e-12;
        const double size = std::sqrt(along[0] * along[0] + along[1] * along[1]);
        if (!(size > kTiny)) return;
        const Eigen::Vector3d n(along[1] / size, -along[0] / size, 0.0);
        visitor(n, gap_along(n, shape, triangle));
        visitor(-n, gap_along(-n, shape, triangle));
    };
    if (shape.kind == ShapeKind::box) {
        for (const Eigen::Vector3d& axis : shape.axes) visit_sides(axis);
        return;
    }
    visit_sides(shape.core);
    // Axes from the vertical edges of the column to the ends of the core, in plan.
    for (const double sign : {-1.0, 1.0}) {
        for (const Eigen::Vector3d& v : triangle.v) {
            const Eigen::Vector3d to = shape.centre + sign * shape.core - v;
            visit_sides(Eigen::Vector3d(-to[1], to[0], 0.0));
        }
    }
    // An axis from a vertical edge to an inner point of the core is perpendicular to the core and was visited above.
}

}  // namespace terrane::internal
