// SPDX-License-Identifier: MIT
//
// In the plane and in height a ball is followed as an upright box around it: when the box is over a
// column and over a row of chunks, then when it is low enough. Only where the box is over a square from
// the beginning on, the ball itself is looked at. A box over every place that a ball could be is a
// little large; that adds few chunks, and none is missed.
//
// What moves at a speed and grows by g t^2 / 2 closes a gap of at most speed t + g t^2 / 2 in t seconds.
#include "paging/demand/body_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace terrane::internal {
namespace {

constexpr double kGravity = 9.81;
constexpr double kNever = std::numeric_limits<double>::infinity();
// A ball is this share of the numbers that place it larger, for what rounding takes away.
constexpr double kRounding = 1e-14;
// Of a chunk's side: a box around a smaller ball is not over many more chunks.
constexpr double kLargeBall = 0.5;
constexpr double kSqrt2 = 1.4142135623730951;
constexpr double kPi = 3.141592653589793;

// The earliest time at which speed * t + growth * t^2 / 2 is `gap`.
double time_to_close(double gap, double speed, double growth) {
    if (gap <= 0.0) return 0.0;
    const double root = std::sqrt(speed * speed + 2.0 * growth * gap);
    if (speed > 0.0) return 2.0 * gap / (speed + root);
    return growth > 0.0 ? (root - speed) / growth : kNever;
}

// How many squares of a side a leg may meet: the area within a diagonal of it.
double square_count(const Leg& leg, double side) {
    const double way = leg.duration > 0.0 ? leg.velocity.head<2>().norm() * leg.duration : 0.0;
    const double growth = 0.5 * leg.growth * leg.duration * leg.duration;
    const double reach = (leg.radius + growth) / side + kSqrt2;
    return (2.0 * way / side + kPi * reach) * reach;
}

// Cuts a leg to a square_count() of `most`, or to a point.
void cut(Leg& leg, double side, double most) {
    const double duration = leg.duration;
    leg.duration = 0.0;
    if (square_count(leg, side) > most) {
        leg.radius = std::max(0.0, side * (std::sqrt(most / kPi) - kSqrt2));
        return;
    }
    constexpr int kHalvings = 64;
    for (int i = 1; i <= kHalvings; ++i) {
        leg.duration = std::ldexp(duration, -i);
        if (square_count(leg, side) <= most) return;
    }
    leg.duration = 0.0;
}

// From a ball to what lies in a closed square and not above a height; negative inside.
double gap_to(const WorldPos& centre, double radius, const WorldRect& square, double height) {
    const double x = std::max({0.0, square.west - centre.x(), centre.x() - square.east});
    const double y = std::max({0.0, square.south - centre.y(), centre.y() - square.north});
    const double z = std::max(0.0, centre.z() - height);
    return std::sqrt(x * x + y * y + z * z) - radius;
}

// The end of an interval that lies between it and two places; nothing where one is over it, or they are
// on two sides.
std::optional<double> end_towards(double low, double high, double a, double b) {
    if (a < low && b < low) return low;
    if (a > high && b > high) return high;
    return std::nullopt;
}

}  // namespace

void find_legs(const BodyNeed& body, double time_s, double horizon, std::vector<Leg>& legs_out) {
    legs_out.clear();
    if (body.trajectory.empty()) {
        legs_out.push_back({0.0, horizon, body.centre_world, body.velocity, body.radius, kGravity});
        return;
    }
    Leg leg{.from_world = body.centre_world, .radius = body.radius};
    const auto first =
        std::lower_bound(body.trajectory.begin(), body.trajectory.end(), time_s,
                         [](const BodyMoment& moment, double now) { return moment.time_s < now; });
    for (auto next = first; next != body.trajectory.end(); ++next) {
        const double left = horizon - leg.begin;
        const double wait = std::max(0.0, next->time_s - time_s - leg.begin);
        leg.velocity = Eigen::Vector3d::Zero();
        if (wait > 0.0) leg.velocity = (next->centre_world - leg.from_world) / wait;
        leg.duration = std::min(wait, left);
        legs_out.push_back(leg);
        if (wait > left) return;
        leg.begin += wait;
        leg.from_world = next->centre_world;
    }
    leg.duration = horizon - leg.begin;
    leg.velocity = Eigen::Vector3d::Zero();
    legs_out.push_back(leg);
}

// The box around a leg's ball, along one axis.
struct BodySweep::Motion {
    double from, speed, radius, growth, duration;
    double low_begin, high_begin, low_end, high_end;

    Motion(const Leg& leg, int axis)
        : from(leg.from_world[axis]),
          speed(leg.velocity[axis]),
          radius(leg.radius),
          growth(leg.growth),
          duration(leg.duration),
          low_begin(from - radius),
          high_begin(from + radius),
          low_end(low(duration)),
          high_end(high(duration)) {}

    // low() is concave, high() convex: their extremes are at the ends.
    double low(double time) const { return from + speed * time - reach(time); }
    double high(double time) const { return from + speed * time + reach(time); }
    double reach(double time) const { return radius + 0.5 * growth * time * time; }
    double lowest() const { return std::min(low_begin, low_end); }
    double highest() const { return std::max(high_begin, high_end); }

    // When it is over an interval, from first to last. It may leave and, as it grows, come back: then it
    // counts as never having left.
    Window over(double west, double east) const {
        Window when{0.0, duration};
        if (high_begin < west) {
            when.enter = time_to_close(west - high_begin, speed, growth);
        } else if (low_begin > east) {
            when.enter = time_to_close(low_begin - east, -speed, growth);
        }
        const bool is_ahead = low_end > east;
        if (is_ahead || high_end < west) {
            // it goes at least as far as if it were all the time as slow as on average
            const double way = is_ahead ? east - low_begin : high_begin - west;
            const double slowest = std::abs(speed) - 0.5 * growth * duration;
            when.leave = std::min(duration, way / slowest);
        }
        return when;
    }
};

void BodySweep::find_lanes(const ChunkAxis& axis, const ChunkSpan& span, const Motion& motion,
                           std::vector<Lane>& lanes_out) {
    lanes_out.clear();
    double low = axis.edge(span.first);
    for (std::int64_t index = span.first; index <= span.last; ++index) {
        const double high = axis.edge(index + 1);
        lanes_out.push_back({low, high, motion.over(low, high)});
        low = high;
    }
}

BodySweep::BodySweep(const HeightSource& source, int level) : grid_(source.lattice(), level) {
    // chunks that only touch the extent's edge hold no ground
    const auto inner = [](const ChunkAxis& axis, double low, double high) {
        ChunkSpan span = axis.touched(low, high, axis.world);
        if (axis.edge(span.first + 1) <= low) ++span.first;
        if (axis.edge(span.last) >= high) --span.last;
        return span;
    };
    const WorldRect& extent = source.extent();
    columns_ = inner(grid_.x, extent.west, extent.east);
    rows_ = inner(grid_.y, extent.south, extent.north);
    highest_ = source.interval(extent).high + source.lattice().quantum;
    for (const ChunkAxis* axis : {&grid_.x, &grid_.y}) {
        scale_ = std::max({scale_, std::abs(axis->edge(axis->world.first)),
                           std::abs(axis->edge(axis->world.last + 1))});
    }
}

// Whether a ball whose box is over a square for some time stays clear of it, because it passes a corner.
bool BodySweep::passes_corner(const Leg& leg, const WorldRect& square, const Window& when) {
    const Eigen::Vector2d from = leg.from_world.head<2>(), velocity = leg.velocity.head<2>();
    const Eigen::Vector2d begin = from + when.enter * velocity, end = from + when.leave * velocity;
    const auto x = end_towards(square.west, square.east, begin.x(), end.x());
    if (!x) return false;
    const auto y = end_towards(square.south, square.north, begin.y(), end.y());
    if (!y) return false;
    // the corner is what is nearest all the time
    const Eigen::Vector2d corner(*x, *y);
    const double nearest = (corner - from).dot(velocity) / velocity.squaredNorm();
    const double time = nearest > when.enter ? std::min(nearest, when.leave) : when.enter;
    const double reach = leg.radius + 0.5 * leg.growth * when.leave * when.leave;
    return (from + time * velocity - corner).squaredNorm() > reach * reach;
}

BodySweep::Looks BodySweep::find(Leg leg, double most, TouchTable& table,
                                 std::vector<Touch>& touches_out) {
    touches_out.clear();
    // what the ball's box is over at some time, where it may be low enough
    ChunkSpan columns, rows;
    const auto find_spans = [&] {
        columns = rows = {};
        const Motion x(leg, 0), y(leg, 1);
        if (Motion(leg, 2).lowest() > highest_) return;
        columns = grid_.x.touched(x.lowest(), x.highest(), columns_);
        rows = grid_.y.touched(y.lowest(), y.highest(), rows_);
    };
    // only places near the world must be exact
    leg.radius += kRounding * (leg.from_world.cwiseAbs().maxCoeff() + scale_ + leg.radius);
    find_spans();
    Looks looks;
    if (columns.count() * rows.count() > most && square_count(leg, grid_.x.side) > most) {
        cut(leg, grid_.x.side, most);
        find_spans();
        looks.is_cut = true;
    }
    if (columns.count() == 0.0 || rows.count() == 0.0) return looks;

    find_lanes(grid_.x, columns, Motion(leg, 0), column_lanes_);
    find_lanes(grid_.y, rows, Motion(leg, 1), row_lanes_);
    Window in_columns{kNever, -kNever};
    for (const Lane& column : column_lanes_) {
        in_columns.enter = std::min(in_columns.enter, column.when.enter);
        in_columns.leave = std::max(in_columns.leave, column.when.leave);
    }
    const Motion z(leg, 2);
    const Eigen::Vector3d& v = leg.velocity;
    const double speed = std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
    const double large = kLargeBall * grid_.x.side;
    std::size_t first = 0;
    for (std::size_t j = 0; j < row_lanes_.size(); ++j) {
        const Lane& row = row_lanes_[j];
        looks.squares += 1.0;
        if (row.when.both(in_columns).is_empty()) continue;
        // the columns of a row follow each other, and one of them is of the row before as well
        const auto is_over = [&](std::size_t i) {
            return !row.when.both(column_lanes_[i].when).is_empty();
        };
        while (first + 1 < column_lanes_.size() && !is_over(first)) ++first;
        while (first > 0 && is_over(first - 1)) --first;
        for (std::size_t i = first; i < column_lanes_.size(); ++i) {
            const Lane& column = column_lanes_[i];
            const Window when = row.when.both(column.when);
            if (when.is_empty()) break;
            looks.squares += 1.0;
            const WorldRect square{column.low, row.low, column.high, row.high};
            if (z.reach(when.leave) > large && passes_corner(leg, square, when)) continue;
            const TouchTable::Slot slot =
                table.slot(static_cast<std::int32_t>(columns.first + static_cast<std::int64_t>(i)),
                           static_cast<std::int32_t>(rows.first + static_cast<std::int64_t>(j)));
            const double height = table.highest(slot);
            double time = when.enter;
            if (time == 0.0) {
                time = time_to_close(gap_to(leg.from_world, leg.radius, square, height), speed,
                                     leg.growth);
            }
            if (const double gap = z.low(time) - height; gap > 0.0) {
                time += time_to_close(gap, leg.growth * time - z.speed, leg.growth);
            }
            const double last = when.leave < leg.duration ? when.leave : kNever;
            if (time <= when.leave) touches_out.push_back({slot, time, last});
        }
    }
    return looks;
}

}  // namespace terrane::internal
