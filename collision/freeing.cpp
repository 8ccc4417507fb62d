// SPDX-License-Identifier: MIT
// Sources: A. Yuille, A. Rangarajan. The concave-convex procedure. Neural Computation 2003 (what is
//          free of a convex obstacle is cut down to a half-space, and again from where that led).
// Deviations: the obstacles are the columns of the ground; a half-space is made only for those that
//             stand in the way. Deep overlaps also start from a fan of sideways offsets.
#include "freeing.h"

#include "half_spaces.h"
#include "normal_cone.h"

namespace terrane::internal {
namespace {

HalfSpace half_space(const Eigen::Vector3d& n, const LocalShape& shape, const Triangle& triangle) {
    return {n, -gap_along(n, shape, triangle)};
}

// From inside: each column that stands in the way is left by its shortest way in the normal cone.
// `least_out` is the least translation that frees the shape of one of those columns alone, a lower bound
// of every answer.
bool find_from_inside(const LocalGround& local, const LocalShape& shape, Eigen::Vector3d& d_out,
                      double& least_out) {
    constexpr int kRounds = 24;
    HalfSpaces spaces;
    d_out = Eigen::Vector3d::Zero();
    least_out = 0.0;
    for (int round = 0; round < kRounds; ++round) {
        const GroundLift lift = find_lift(local, shape, d_out, 0.1 * kFree);
        if (!(lift.lift > 0.1 * kFree)) return true;
        least_out = std::max(least_out, -find_separation(shape, lift.triangle, true).gap);
        Separation best{lift.triangle.normal,
                        gap_along(lift.triangle.normal, shape, lift.triangle)};
        visit_tops(shape, lift.triangle, [&](const Eigen::Vector3d& n, double gap) {
            if (gap > best.gap && is_in_normal_cone(local, lift.triangle, n)) best = {n, gap};
        });
        // The same column again: its plane was made for another direction.
        if (dot(best.normal, d_out) + best.gap > 0.0) {
            best = {lift.triangle.normal, gap_along(lift.triangle.normal, shape, lift.triangle)};
        }
        spaces.add({best.normal, -best.gap});
        if (!find_shortest(spaces, d_out)) return false;
    }
    return !(find_lift(local, shape, d_out, 0.5 * kFree).lift > 0.5 * kFree);
}

// From a free place towards the shape: shorter with every round, and free all the way.
Eigen::Vector3d shorten(const LocalGround& local, const LocalShape& shape, Eigen::Vector3d d) {
    constexpr int kRounds = 24;
    constexpr int kColumns = 24;
    for (int round = 0; round < kRounds; ++round) {
        LocalShape moved = shape;
        moved.centre += d;
        HalfSpaces spaces;
        Eigen::Vector3d next = Eigen::Vector3d::Zero();
        bool is_free = false;
        for (int i = 0; i < kColumns; ++i) {
            const GroundLift lift = find_lift(local, shape, next, 0.1 * kFree);
            if (!(lift.lift > 0.1 * kFree)) {
                is_free = true;
                break;
            }
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
            spaces.add(half_space(best.normal, shape, lift.triangle));
            if (!find_shortest(spaces, next)) break;
        }
        const double before = length(d);
        if (!is_free || !(length(next) < before)) return d;
        d = next;
        if (before - length(next) < 1e-13 * before) return d;
    }
    return d;
}

}  // namespace

Eigen::Vector3d find_freeing(const LocalGround& local, const LocalShape& shape, double lift) {
    if (!(lift > 0.0)) return Eigen::Vector3d::Zero();
    const Eigen::Vector3d up(0.0, 0.0, lift);
    Eigen::Vector3d best = up;
    Eigen::Vector3d inside;
    double least = 0.0;
    if (find_from_inside(local, shape, inside, least) && length(inside) <= lift) {
        if (length(inside) <= least * (1.0 + 1e-12) + kFree) return inside;
        best = shorten(local, shape, inside);
    }
    const Eigen::Vector3d from_above = shorten(local, shape, up);
    if (length(from_above) < length(best)) best = from_above;
    if (!(length(best) > 0.2 * shape.smallest)) return best;

    // Deep: sideways offsets on rings, each with the lift that is left there.
    constexpr std::array<double, 5> kRings{0.15, 0.35, 0.55, 0.75, 0.95};
    constexpr double kDiagonal = 0.70710678118654752;
    constexpr std::array<std::array<double, 2>, 8> kDirections{{{1.0, 0.0},
                                                                {kDiagonal, kDiagonal},
                                                                {0.0, 1.0},
                                                                {-kDiagonal, kDiagonal},
                                                                {-1.0, 0.0},
                                                                {-kDiagonal, -kDiagonal},
                                                                {0.0, -1.0},
                                                                {kDiagonal, -kDiagonal}}};
    const double reach = length(best);
    Eigen::Vector3d start = best;
    for (const double ring : kRings) {
        for (const std::array<double, 2>& direction : kDirections) {
            Eigen::Vector3d offset(ring * reach * direction[0], ring * reach * direction[1], 0.0);
            // more than what is left of the shortest so far helps nobody
            const double square = dot(start, start) - dot(offset, offset);
            if (!(square > 0.0)) continue;
            const double enough = std::sqrt(square) * (1.0 + 1e-9);
            const double rest = find_lift(local, shape, offset, 0.0, enough).lift;
            offset[2] = std::max(rest, 0.0);
            if (length(offset) < length(start)) start = offset;
        }
    }
    if (length(start) < length(best)) best = shorten(local, shape, start);
    return best;
}

}  // namespace terrane::internal
