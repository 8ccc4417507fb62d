// SPDX-License-Identifier: MIT
#pragma once

#include "column.h"
#include "ground_lift.h"
#include "nearest.h"

#include <terrane/collision/ground_cast.h>

#include <algorithm>

// How far a moving, turning shape may go before it can meet a column of the ground.
namespace terrane::internal {

// What a cast knows about its motion; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in)
        : shape(shape_in), motion(motion_in), spin(length(motion_in.rotation_vector)) {
        const LocalShape start = make_local_shape(shape, motion.start.rotation);
        smallest = start.smallest;
        if (spin == 0.0) return;
        const Eigen::Vector3d axis = motion.rotation_vector / spin;
        if (start.is_box) {
            for (int i = 0; i < 8; ++i) arm = std::max(arm, length(cross(axis, start.corner(i))));
        } else {
            arm = length(cross(axis, start.core));  // turning a ball about its centre moves nothing
        }
    }

    // The shape at t, seen from a local frame.
    LocalShape at(const LocalGround& local, double t) const {
        const Pose pose = motion.at(t);
        LocalShape moved = make_local_shape(shape, pose.rotation);
        moved.centre = local.to_local(motion.start.translation) + t * motion.translation;
        return moved;
    }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;      ///< radians in all
    double arm = 0.0;       ///< largest distance from the axis of what turning moves, metres
    double smallest = 0.0;  ///< half extent
};

// Time after which the gap along n, taken by the moving points of a shape, may be down to `rest`.
inline double bound_time(const Sweep& sweep, const LocalShape& shape, const Eigen::Vector3d& n,
                         double gap, double rest, double remaining) {
    const double speed = -dot(n, sweep.motion.translation);
    const Eigen::Vector3d turn = cross(n, sweep.motion.rotation_vector);
    const double closing = speed + length(turn) * sweep.arm;
    double time = closing > 0.0 ? (gap - rest) / closing : std::numeric_limits<double>::infinity();
    if (time >= remaining || sweep.arm == 0.0) return time;
    // Each point starts at its own gap, at its own speed, and is bent by at most this.
    const double bend = sweep.spin * sweep.spin * sweep.arm;
    const double extent = shape.extent(n);
    double each = std::numeric_limits<double>::infinity();
    const auto take = [&](const Eigen::Vector3d& arm, double radius) {
        const double room = gap - rest + extent + dot(n, arm) - radius;
        const double rate = dot(turn, arm) - speed;  // n . (v + w x arm)
        // room + rate t - bend t^2 / 2 = 0
        const double root =
            std::sqrt(std::max(0.0, rate * rate + 2.0 * bend * std::max(0.0, room)));
        const double when =
            rate < 0.0 ? 2.0 * std::max(0.0, room) / (root - rate) : (rate + root) / bend;
        each = std::min(each, when);
    };
    if (shape.is_box) {
        for (int i = 0; i < 8; ++i) take(shape.corner(i) - shape.centre, 0.0);
    } else {
        take(shape.core, shape.radius);
        take(-shape.core, shape.radius);
    }
    return std::max(time, each);
}

// One look at all columns that could be met in the rest of a piece.
struct AdvanceVisitor {
    const LocalGround& local;
    const Sweep& sweep;
    const LocalShape& shape;  ///< where it is now
    Eigen::Vector3d centre;   ///< of the bounds of the rest of the piece
    Eigen::Vector3d bounds;
    double tolerance;
    double sink;  ///< how much lower the ground counts as
    double step;  ///< shortest time found; starts as what is left of the piece
    bool is_hit = false;
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    bool is_missing = false;
    double error_m = 0.0;

    bool wants(const Prism& prism) const {
        return bound_distance(centre, bounds, prism) <= tolerance && can_meet(prism);
    }

    // Whether anything in a prism may be met before the shortest time so far.
    bool can_meet(const Prism& prism) const {
        const double turning = sweep.spin * sweep.arm;
        const Eigen::Vector3d& v = sweep.motion.translation;
        const auto is_later = [&](double gap, double speed) {
            const double closing = speed + turning;
            return gap > tolerance && (closing <= 0.0 || gap - tolerance >= step * closing);
        };
        const Eigen::Vector3d low = shape.centre - shape.bounds;
        const Eigen::Vector3d high = shape.centre + shape.bounds;
        if (is_later(low[2] - prism.high + sink, -v[2]) || is_later(low[0] - prism.east, -v[0]) ||
            is_later(prism.west - high[0], v[0]) || is_later(low[1] - prism.north, -v[1]) ||
            is_later(prism.south - high[1], v[1])) {
            return false;
        }
        if (!shape.is_box) return true;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d n = shape.up(i);
            const double top = std::max(n[0] * (prism.west - shape.centre[0]),
                                        n[0] * (prism.east - shape.centre[0])) +
                               std::max(n[1] * (prism.south - shape.centre[1]),
                                        n[1] * (prism.north - shape.centre[1])) +
                               n[2] * (prism.high - shape.centre[2]);
            if (is_later(sink * n[2] - top - shape.half[static_cast<Eigen::Index>(i)],
                         -dot(n, v))) {
                return false;
            }
        }
        return true;
    }

    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        const double x = std::max(prism.west - shape.centre[0] - shape.bounds[0],
                                  shape.centre[0] - shape.bounds[0] - prism.east);
        const double y = std::max(prism.south - shape.centre[1] - shape.bounds[1],
                                  shape.centre[1] - shape.bounds[1] - prism.north);
        const double turning = sweep.spin * sweep.arm;
        // Up to where the bounds reach the cell, from whichever side holds longer.
        const auto time = [&](double gap, double speed) {
            return gap <= 0.0 ? 0.0 : gap / (std::abs(speed) + turning + 1e-300);
        };
        const double z = shape.centre[2] - shape.bounds[2] - prism.high;
        const double when =
            std::max({time(x, sweep.motion.translation[0]), time(y, sweep.motion.translation[1]),
                      time(z, sweep.motion.translation[2])});
        if (when < step) {
            step = when;
            is_missing = true;
            is_hit = false;
        }
        return true;
    }

    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        error_m = std::max(error_m, static_cast<double>(cell.error_m));
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
            const double time = bound_time(sweep, shape, n, gap, rest_of(gap), step);
            when = std::max(when, time);
            is_passed = when >= step;
        };
        const auto look_top = [&](const Eigen::Vector3d& n, double gap) { look(n, gap + sink); };
        look_top(triangle.normal, gap_along(triangle.normal, shape, triangle));
        if (is_passed) return;
        visit_tops(shape, triangle, look_top);
        if (is_passed) return;
        visit_walls(shape, triangle, look);
        if (is_passed) return;
        if (widest <= 0.25 * tolerance) {
            // Planes may be near where corners are not.
            if (shape.is_box && sink == 0.0 && widest > 0.0) {
                const ClosestPair pair = find_closest(shape, triangle);
                if (pair.distance > 0.5 * tolerance) {
                    const Eigen::Vector3d n = (pair.on_shape - pair.on_triangle) / pair.distance;
                    if (n[2] >= 0.0) look(n, gap_along(n, shape, triangle));
                    if (is_passed) return;
                }
            }
            if (widest <= 0.25 * tolerance) {
                step = 0.0;
                is_hit = true;
                is_missing = false;
                hit_normal = normal;
                return;
            }
        }
        step = std::max(0.0, when);
        is_hit = false;
        is_missing = false;
    }

    double rest_of(double gap) const { return std::min(0.125 * tolerance, 0.5 * gap); }
};

}  // namespace terrane::internal
