// SPDX-License-Identifier: MIT
//
// Sources: A. Yuille, A. Rangarajan. The concave-convex procedure. Neural Computation 2003 (the complement of a convex
//          obstacle is replaced by a half-space inside it, iteratively).
// Deviations: the obstacles are the columns of the ground; half-spaces are made only for columns that the shape
//             overlaps. The local minimum is the first upper bound of the global search (min_translation_search).
#include "ground/heightfield/min_translation.h"

#include "ground/column/local_ground.h"
#include "pairs/convex_core.h"

namespace terrane::internal {
namespace {

// The direction in which a shape leaves a column that it overlaps after a translation by `d`: the direction of smallest
// overlap in the ground's normal cone or, if the shape moved by `d` has left the column along it already, the normal of
// the column's face. `least_out` is the length of the minimum translation out of this column alone: the smallest
// overlap along the normals of the facets of the Minkowski difference.
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
    // visit_tops() omits these normals of a capsule if its core does not touch the triangle, although the core may
    // intersect the column.
    if (shape.kind == ShapeKind::round && shape.has_core()) {
        for (std::size_t i = 0; i < 3; ++i) {
            Eigen::Vector3d n = cross(shape.core, triangle.v[(i + 1) % 3] - triangle.v[i]);
            if (n[2] < 0.0) n = -n;
            const double size = length(n);
            if (!(size > 0.0)) continue;
            n /= size;
            widest = std::max(widest, gap_along(n, shape, triangle));
        }
    }
    least_out = -widest;
    // If the shape moved by d has left the column along the best direction, the half-space of that was added before.
    return dot(best.normal, d) + best.gap > 0.0 ? face : best;
}

// Adds a half-space for each overlapped column in turn and solves for the shortest translation inside all half-spaces.
// `least_out` is a lower bound of the minimum translation's length: the largest `least_out` of find_exit().
bool find_from_inside(const LocalGround& local, const LocalBody& body, Eigen::Vector3d& d_out,
                      double& least_out) {
    constexpr int kRounds = 24;
    HalfSpaces spaces;
    d_out = Eigen::Vector3d::Zero();
    least_out = 0.0;
    for (int round = 0; round < kRounds; ++round) {
        const GroundLift lift = find_lift(local, body, d_out, 0.1 * kSeparatedLift);
        if (!(lift.lift > 0.1 * kSeparatedLift)) return true;
        LocalHull hull;
        const LocalShape shape = body.part(lift.part, hull);
        double least = 0.0;
        const Separation best = find_exit(local, shape, lift.triangle, d_out, least);
        least_out = std::max(least_out, least);
        spaces.add({best.normal, -best.gap});
        if (!find_shortest(spaces, d_out)) return false;
    }
    return !(find_lift(local, body, d_out, 0.5 * kSeparatedLift).lift > 0.5 * kSeparatedLift);
}

}  // namespace

Eigen::Vector3d shorten(const LocalGround& local, const LocalBody& body, Eigen::Vector3d d) {
    constexpr int kRounds = 24;
    constexpr int kColumns = 24;
    for (int round = 0; round < kRounds; ++round) {
        HalfSpaces spaces;
        Eigen::Vector3d next = Eigen::Vector3d::Zero();
        bool is_separated = false;
        for (int i = 0; i < kColumns; ++i) {
            const GroundLift lift = find_lift(local, body, next, 0.1 * kSeparatedLift);
            if (!(lift.lift > 0.1 * kSeparatedLift)) {
                is_separated = true;
                break;
            }
            LocalHull hull;
            const LocalShape shape = body.part(lift.part, hull);
            LocalShape moved = shape;
            moved.centre += d;
            // Of the planes that separate `moved` from the column, chooses the one that `shape` overlaps least.
            Separation best;
            const auto offer = [&](const Eigen::Vector3d& n, double gap) {
                if (gap < -kSeparatedLift) return;
                const double depth = gap - dot(n, d);
                if (depth > best.gap) best = {n, depth};
            };
            visit_tops(moved, lift.triangle, offer);
            visit_walls(moved, lift.triangle, offer);
            if (!(best.gap > -std::numeric_limits<double>::infinity())) break;
            spaces.add({best.normal, -gap_along(best.normal, shape, lift.triangle)});
            if (!find_shortest(spaces, next)) break;
        }
        const double before = length(d);
        if (!is_separated || !(length(next) < before)) return d;
        d = next;
        if (before - length(next) < 1e-13 * before) return d;
    }
    return d;
}

Eigen::Vector3d find_short_translation(const LocalGround& local, const LocalBody& body,
                                       double lift) {
    Eigen::Vector3d d;
    double least = 0.0;
    if (find_from_inside(local, body, d, least) && length(d) <= lift) return d;
    return shorten(local, body, Eigen::Vector3d(0.0, 0.0, lift));
}

MinTranslation find_min_translation(const LocalGround& local, const LocalBody& body, double lift,
                                    const SearchLimits& limits) {
    if (!(lift > 0.0)) return {};
    MinTranslation best{Eigen::Vector3d(0.0, 0.0, lift), 0.0};
    Eigen::Vector3d from_inside = Eigen::Vector3d::Zero();
    double least = 0.0;
    if (find_from_inside(local, body, from_inside, least) && length(from_inside) <= lift) {
        const double size = length(from_inside);
        if (is_minimum(size, least)) return {from_inside, std::min(size, least)};
        best.d = shorten(local, body, from_inside);
    }
    const Eigen::Vector3d from_above = shorten(local, body, Eigen::Vector3d(0.0, 0.0, lift));
    if (length(from_above) < length(best.d)) best.d = from_above;
    best.lower_bound = std::min(least, length(best.d));
    return search_min_translation(local, body, best, limits);
}

}  // namespace terrane::internal
