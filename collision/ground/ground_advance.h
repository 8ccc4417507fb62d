// SPDX-License-Identifier: MIT
#pragma once

#include "column.h"
#include "ground_lift.h"
#include "nearest.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

// How far a moving, turning shape may go before it can meet a column of the ground.
namespace terrane::internal {

// Largest distance of what turning moves of a shape from an axis through its body's origin: turning a
// ball about its centre moves nothing.
double find_arm(const LocalShape& shape, const Eigen::Vector3d& axis);

// What a cast knows about its motion; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in);

    // The body at t, seen from a local frame.
    LocalBody at(const LocalGround& local, double t) const {
        return {shape, motion.at(t).rotation,
                local.to_local(motion.start.translation) + t * motion.translation};
    }
    // Of a part, once it is made.
    double arm_of(const LocalShape& part) const { return spin == 0.0 ? 0.0 : find_arm(part, axis); }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;  ///< radians in all
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    double arm = 0.0;  ///< of the whole body, metres
};

// Time after which the gap along n, taken by the moving points of a shape, may be down to `rest`.
//
// `arm` is the largest distance of those points from the axis of the spin, metres.
double bound_time(const Sweep& sweep, const LocalShape& shape, double arm, const Eigen::Vector3d& n,
                  double gap, double rest, double remaining);

// Bounds of everything that a box passes while it moves on by `way` and its points turn by `turned` metres.
struct PassedBox {
    PassedBox(const Eigen::Vector3d& start, const Eigen::Vector3d& bounds_in,
              const Eigen::Vector3d& way, double turned)
        : centre(start + 0.5 * way) {
        for (int i = 0; i < 3; ++i) bounds[i] = bounds_in[i] + 0.5 * std::abs(way[i]) + turned;
    }
    Eigen::Vector3d centre;
    Eigen::Vector3d bounds;
};

// What one look at all columns that could be met in the rest of a piece finds.
struct Advance {
    double step;  ///< shortest time found; starts as what is left of the piece
    bool is_hit = false;
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    std::uint32_t hit_part = 0;
    bool is_missing = false;
    double error_m = 0.0;
};

// The look of one part.
struct AdvanceVisitor {
    const LocalGround& local;
    const Sweep& sweep;
    const LocalShape& shape;  ///< where it is now
    std::uint32_t part;
    double arm;
    PassedBox passed;  ///< in the rest of the piece
    double tolerance;
    double sink;  ///< how much lower the ground counts as
    Advance& found;

    bool wants(const Prism& prism) const {
        return bound_distance(passed.centre, passed.bounds, prism) <= tolerance && can_meet(prism);
    }

    // Whether anything in a prism may be met before the shortest time so far.
    bool can_meet(const Prism& prism) const {
        const double turning = sweep.spin * arm;
        const Eigen::Vector3d& v = sweep.motion.translation;
        const auto is_later = [&](double gap, double speed) {
            const double closing = speed + turning;
            return gap > tolerance && (closing <= 0.0 || gap - tolerance >= found.step * closing);
        };
        const Eigen::Vector3d low = shape.centre - shape.bounds;
        const Eigen::Vector3d high = shape.centre + shape.bounds;
        if (is_later(low[2] - prism.high + sink, -v[2]) || is_later(low[0] - prism.east, -v[0]) ||
            is_later(prism.west - high[0], v[0]) || is_later(low[1] - prism.north, -v[1]) ||
            is_later(prism.south - high[1], v[1])) {
            return false;
        }
        bool can_be = true;
        visit_down_planes(shape, [&](const Eigen::Vector3d& n, double drop) {
            const double top = std::max(n[0] * (prism.west - shape.centre[0]),
                                        n[0] * (prism.east - shape.centre[0])) +
                               std::max(n[1] * (prism.south - shape.centre[1]),
                                        n[1] * (prism.north - shape.centre[1])) +
                               n[2] * (prism.high - shape.centre[2]);
            can_be = can_be && !is_later(sink * n[2] - top - drop, -dot(n, v));
        });
        return can_be;
    }

    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        const double x = std::max(prism.west - shape.centre[0] - shape.bounds[0],
                                  shape.centre[0] - shape.bounds[0] - prism.east);
        const double y = std::max(prism.south - shape.centre[1] - shape.bounds[1],
                                  shape.centre[1] - shape.bounds[1] - prism.north);
        const double turning = sweep.spin * arm;
        // Up to where the bounds reach the cell, from whichever side holds longer.
        const auto time = [&](double gap, double speed) {
            return gap <= 0.0 ? 0.0 : gap / (std::abs(speed) + turning + 1e-300);
        };
        const double z = shape.centre[2] - shape.bounds[2] - prism.high;
        const double when =
            std::max({time(x, sweep.motion.translation[0]), time(y, sweep.motion.translation[1]),
                      time(z, sweep.motion.translation[2])});
        if (when < found.step) {
            found.step = when;
            found.is_missing = true;
            found.is_hit = false;
        }
        return true;
    }

    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        found.error_m = std::max(found.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) take(triangle);
    }

    void take(const Triangle& triangle) {
        double when = -std::numeric_limits<double>::infinity();
        double widest = -std::numeric_limits<double>::infinity();
        Eigen::Vector3d normal = triangle.normal;
        bool is_passed = false;
        const auto look = [&](const Eigen::Vector3d& n, double gap) {
            if (gap > widest) {
                widest = gap;
                normal = n;
            }
            if (is_passed || gap < 0.0) return;
            const double time = bound_time(sweep, shape, arm, n, gap, rest_of(gap), found.step);
            when = std::max(when, time);
            is_passed = when >= found.step;
        };
        const auto look_top = [&](const Eigen::Vector3d& n, double gap) { look(n, gap + sink); };
        look_top(triangle.normal, gap_along(triangle.normal, shape, triangle));
        if (is_passed) return;
        if (shape.kind == ShapeKind::hull && sink == 0.0) {
            // The way between nearest points is the widest of all.
            const ClosestPair pair = find_closest_in_column(*shape.hull, shape.centre, triangle);
            if (pair.distance > kTouch) {
                const Eigen::Vector3d n = (pair.on_shape - pair.on_triangle) / pair.distance;
                look(n, gap_along(n, shape, triangle));
            }
        }
        if (is_passed) return;
        if (!(shape.kind == ShapeKind::hull && sink == 0.0 && widest > kTouch)) {
            visit_tops(shape, triangle, look_top);
            if (is_passed) return;
            visit_walls(shape, triangle, look);
            if (is_passed) return;
        }
        if (widest <= 0.25 * tolerance) {
            // Planes may be near where corners are not.
            if (shape.kind == ShapeKind::box && sink == 0.0 && widest > 0.0) {
                const ClosestPair pair = find_closest(shape, triangle);
                if (pair.distance > 0.5 * tolerance) {
                    const Eigen::Vector3d n = (pair.on_shape - pair.on_triangle) / pair.distance;
                    if (n[2] >= 0.0) look(n, gap_along(n, shape, triangle));
                    if (is_passed) return;
                }
            }
            if (widest <= 0.25 * tolerance) {
                found.step = 0.0;
                found.is_hit = true;
                found.is_missing = false;
                found.hit_normal = normal;
                found.hit_part = part;
                return;
            }
        }
        found.step = std::max(0.0, when);
        found.is_hit = false;
        found.is_missing = false;
    }

    double rest_of(double gap) const { return std::min(0.125 * tolerance, 0.5 * gap); }
};

}  // namespace terrane::internal
