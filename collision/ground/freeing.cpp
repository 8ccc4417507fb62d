// SPDX-License-Identifier: MIT
// Sources: A. Yuille, A. Rangarajan. The concave-convex procedure. Neural Computation 2003 (what is
//          free of a convex obstacle is cut down to a half-space, and again from where that led).
// Deviations: the obstacles are the columns of the ground; a half-space is made only for those that
//             stand in the way. Deep overlaps also start from a grid of sideways offsets.
#include "freeing.h"

#include "closest_points.h"
#include "half_spaces.h"
#include "normal_cone.h"
#include "shortest_way.h"
#include "triangle_plane.h"

namespace terrane::internal {
namespace {

// The way to leave a column that holds a shape at `d`: the shortest in the ground's normal cone; where that is
// known not to do, the normal of its face. `least_out` is the least translation that frees the shape of this column alone.
Separation find_exit(const LocalGround& local, const LocalShape& shape, const Triangle& triangle,
                     const Eigen::Vector3d& d, double& least_out) {
    const Separation face{triangle.normal, gap_along(triangle.normal, shape, triangle)};
    Separation best = face;
    double widest = face.gap;
    visit_tops(shape, triangle, [&](const Eigen::Vector3d& n, double gap) {
        widest = std::max(widest, gap);
        if (gap > best.gap && is_in_normal_cone(local, triangle, n)) best = {n, gap};
    });
    visit_walls(shape, triangle,
                [&](const Eigen::Vector3d&, double gap) { widest = std::max(widest, gap); });
    least_out = -widest;
    // The same column again: its plane was made for another direction.
    return dot(best.normal, d) + best.gap > 0.0 ? face : best;
}

// Deep down a translation may be longer than the shortest one: that one is at least this much of it.
constexpr double kShare = 0.8;

// Whether the shortest translation is deep, where one of this length frees.
bool is_deep(double length, double smallest) { return kShare * length > kDeep * smallest; }

// From inside: each column that stands in the way is left by its shortest way in the normal cone.
// `least_out` is the least translation that frees a part of one of those columns alone, a lower bound
// of every answer.
bool find_from_inside(const LocalGround& local, const LocalBody& body, Eigen::Vector3d& d_out,
                      double& least_out) {
    constexpr int kRounds = 24;
    HalfSpaces spaces;
    d_out = Eigen::Vector3d::Zero();
    least_out = 0.0;
    for (int round = 0; round < kRounds; ++round) {
        const GroundLift lift = find_lift(local, body, d_out, 0.1 * kFree);
        if (!(lift.lift > 0.1 * kFree)) return true;
        LocalHull hull;
        const LocalShape shape = body.part(lift.part, hull);
        double least = 0.0;
        const Separation best = find_exit(local, shape, lift.triangle, d_out, least);
        least_out = std::max(least_out, least);
        spaces.add({best.normal, -best.gap});
        if (!find_shortest(spaces, d_out)) return false;
    }
    return !(find_lift(local, body, d_out, 0.5 * kFree).lift > 0.5 * kFree);
}

// Whether the surface comes nearer than `reach` to a point under it, in a range of cells that are all ground.
bool is_surface_near(const LocalGround& local, const Eigen::Vector3d& p, double reach,
                     const CellRange& cells) {
    struct Visitor {
        const LocalGround& local;
        const Eigen::Vector3d& p;
        double reach;
        bool is_near = false;

        bool wants(const Prism& prism) const {
            const double x = std::max({0.0, prism.west - p[0], p[0] - prism.east});
            const double y = std::max({0.0, prism.south - p[1], p[1] - prism.north});
            const double z = std::max(0.0, prism.low - p[2]);
            return !is_near && x * x + y * y + z * z < reach * reach;
        }
        bool miss(const Prism&) {
            is_near = true;
            return false;
        }
        void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
            for (const Triangle& triangle : local.triangles(cell, column, row)) {
                if (std::abs(dot(triangle.normal, triangle.v[0] - p)) >= reach) continue;
                const Eigen::Vector3d to = closest_on_triangle(p, triangle) - p;
                if (dot(to, to) < reach * reach) is_near = true;
            }
        }
    };
    Visitor visitor{local, p, reach};
    visit_cells(local, cells, visitor);
    return visitor.is_near;
}

// The triangles of the cell that a point is over or under: false where that is no ground.
bool find_cell_at(const LocalGround& local, const Eigen::Vector3d& p,
                  std::array<Triangle, 2>& triangles_out) {
    const CellRange over = local.cells(p[0], p[1], p[0], p[1]);
    if (over.east < over.west || over.north < over.south) return false;
    const GroundCell cell = local.cell(over.east, over.north);
    if (cell.status != GroundStatus::ok) return false;
    triangles_out = local.triangles(cell, over.east, over.north);
    return true;
}

// Whether a point of a shape is under the ground by more than a height: then so is the shape.
bool is_below(const LocalGround& local, const Eigen::Vector3d& p, double height) {
    std::array<Triangle, 2> triangles;
    if (!find_cell_at(local, p, triangles)) return false;
    for (const Triangle& triangle : triangles) {
        if (is_over(p, triangle) && TrianglePlane(triangle).above(p) > height) return true;
    }
    return false;
}

// Whether no translation of under `share` of the length of `d` frees the shape, seen from the point of it that
// `d` takes furthest out: while that is inside the ground the shape is not free, and the surface is further away.
bool is_far_inside(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& d,
                   double share) {
    const double size = length(d);
    const double reach = share * size;
    const Eigen::Vector3d p = shape.deepest_point(d / size);
    const CellRange cells = local.cells(p[0] - reach, p[1] - reach, p[0] + reach, p[1] + reach);
    std::array<Triangle, 2> triangles;
    if (!find_cell_at(local, p, triangles)) return false;
    bool is_inside = false;
    for (const Triangle& triangle : triangles) {
        is_inside =
            is_inside || (dot(triangle.normal, triangle.v[0] - p) >= reach && is_over(p, triangle));
    }
    // Where ground ends there is a way out too.
    return is_inside && local.is_all_ground(cells) && !is_surface_near(local, p, reach, cells);
}

// A translation that frees a body and is much shorter than a known one, or that one: sideways offsets on a grid,
// each with the lift that is left there.
Eigen::Vector3d look_around(const LocalGround& local, const LocalBody& body,
                            const Eigen::Vector3d& known) {
    constexpr int kSide = 20;  // steps to each side
    const double step = kShare * length(known) / kSide;
    Eigen::Vector3d best = known;
    // Most offsets are told to be hopeless by one of a few points.
    std::array<Eigen::Vector3d, 3> inside;
    std::size_t inside_count = 0;
    if (!body.is_compound()) {
        const LocalShape& shape = body.whole();
        inside = {shape.deepest_point(known / length(known)),
                  shape.deepest_point(Eigen::Vector3d::UnitZ()), shape.centre};
        inside_count = inside.size();
    }
    for (int row = -kSide; row <= kSide; ++row) {
        for (int column = -kSide; column <= kSide; ++column) {
            Eigen::Vector3d offset(step * column, step * row, 0.0);
            const double square = kShare * kShare * dot(best, best) - dot(offset, offset);
            if (!(square > 0.0)) continue;
            const double enough = std::sqrt(square);
            bool is_hopeless = false;
            for (std::size_t i = 0; i < inside_count && !is_hopeless; ++i) {
                is_hopeless = is_below(local, inside[i] + offset, enough);
            }
            if (is_hopeless) continue;
            const double rest = find_lift(local, body, offset, 0.0, enough).lift;
            offset[2] = std::max(rest, 0.0);
            if (length(offset) < kShare * length(best)) best = offset;
        }
    }
    return best;
}

}  // namespace

Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d) {
    constexpr int kRounds = 24;
    constexpr int kColumns = 24;
    for (int round = 0; round < kRounds; ++round) {
        HalfSpaces spaces;
        Eigen::Vector3d next = Eigen::Vector3d::Zero();
        bool is_free = false;
        for (int i = 0; i < kColumns; ++i) {
            const GroundLift lift = find_lift(local, body, next, 0.1 * kFree);
            if (!(lift.lift > 0.1 * kFree)) {
                is_free = true;
                break;
            }
            LocalHull hull;
            const LocalShape shape = body.part(lift.part, hull);
            LocalShape moved = shape;
            moved.centre += d;
            // Of the planes that part the column from where the shape is free, the one nearest to
            // where the shape comes from.
            Separation best;
            const auto take = [&](const Eigen::Vector3d& n, double gap) {
                if (gap < -kFree) return;
                const double depth = gap - dot(n, d);
                if (depth > best.gap) best = {n, depth};
            };
            visit_tops(moved, lift.triangle, take);
            visit_walls(moved, lift.triangle, take);
            if (!(best.gap > -std::numeric_limits<double>::infinity())) break;
            spaces.add({best.normal, -gap_along(best.normal, shape, lift.triangle)});
            if (!find_shortest(spaces, next)) break;
        }
        const double before = length(d);
        if (!is_free || !(length(next) < before)) return d;
        d = next;
        if (before - length(next) < 1e-13 * before) return d;
    }
    return d;
}

bool is_short_enough(double smallest, double length, double least) {
    return length <= least * (1.0 + 1e-12) + kFree ||
           (is_deep(length, smallest) && kShare * length <= least);
}

Eigen::Vector3d find_freeing(const LocalGround& local, const LocalBody& body, double lift) {
    if (!(lift > 0.0)) return Eigen::Vector3d::Zero();
    const Eigen::Vector3d up(0.0, 0.0, lift);
    Eigen::Vector3d best = up;
    Eigen::Vector3d from_inside = Eigen::Vector3d::Zero();
    double least = 0.0;
    if (find_from_inside(local, body, from_inside, least) && length(from_inside) <= lift) {
        const double smallest = body.whole().smallest;
        if (is_short_enough(smallest, length(from_inside), least)) return from_inside;
        if (!body.is_compound() && is_deep(length(from_inside), smallest) &&
            is_far_inside(local, body.whole(), from_inside, kShare)) {
            return from_inside;
        }
        best = shorten(local, body, from_inside);
    }
    const Eigen::Vector3d from_above = shorten(local, body, up);
    if (length(from_above) < length(best)) best = from_above;
    if (!is_deep(length(best), body.whole().smallest)) {
        // Cells that are smaller than the way have more sides than ways out.
        return length(best) < local.spacing() ? find_shortest_way(local, body, best) : best;
    }
    // Where it is the way from inside, that was not proved before.
    if (!body.is_compound() && best != from_inside &&
        is_far_inside(local, body.whole(), best, kShare)) {
        return best;
    }
    const Eigen::Vector3d start = look_around(local, body, best);
    if (length(start) < length(best)) best = shorten(local, body, start);
    if (length(best) < 4.0 * local.spacing()) best = find_shortest_way(local, body, best);
    return best;
}

}  // namespace terrane::internal
