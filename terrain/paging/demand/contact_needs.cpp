// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

// Maximum number of unused cached chunks.
constexpr std::size_t kSpareChunks = 4096;

}  // namespace

TouchTable::TouchTable(const HeightSource& source, int level)
    : source_(source),
      level_(static_cast<std::uint8_t>(level)),
      index_(64),
      most_chunks_(kSpareChunks) {}

void TouchTable::clear() {
    if (chunks_.size() > most_chunks_) drop_unused();
    for (const Slot slot : touched_) chunks_[slot].time_index = kNever;
    touched_.clear();
    ++round_;
}

TouchTable::Slot TouchTable::add(const ChunkKey& key) {
    Slot parent = kNone;
    if (key.level > 0) {
        parent = index_[bucket_of(key.parent())].slot;
        if (parent == kNone) parent = add(key.parent());
    }
    if (2 * (chunks_.size() + 1) > index_.size()) {
        index_.assign(2 * index_.size(), {});
        for (Slot slot = 0; slot < chunks_.size(); ++slot) {
            index_[bucket_of(chunks_[slot].key)] = {chunks_[slot].key, slot};
        }
    }
    const auto slot = static_cast<Slot>(chunks_.size());
    index_[bucket_of(key)] = {key, slot};
    chunks_.push_back({.key = key, .parent = parent});
    if (parent != kNone) chunks_[parent].child[static_cast<std::size_t>(key.quadrant())] = slot;
    return slot;
}

double TouchTable::find_highest(const ChunkKey& key) const {
    const Lattice& lattice = source_.lattice();
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    const HeightInterval heights =
        source_.interval({lattice.x(corner.x), lattice.y(corner.y), lattice.x(corner.x + side),
                          lattice.y(corner.y + side)});
    return heights.high + lattice.quantum;  // samples are rounded to quanta
}

void TouchTable::touch_ancestors() {
    const std::size_t count = touched_.size();
    for (std::size_t i = 0; i < count; ++i) {
        const TimeIndex time_index = chunks_[touched_[i]].time_index;
        const double end = chunks_[touched_[i]].end;
        const bool is_of_region = chunks_[touched_[i]].is_of_region;
        Slot ancestor = chunks_[touched_[i]].parent;
        // an ancestor whose touch begins as early, lasts as long and is of a region has already been propagated
        while (ancestor != kNone &&
               (chunks_[ancestor].time_index > time_index || chunks_[ancestor].end < end ||
                (is_of_region && !chunks_[ancestor].is_of_region))) {
            touch(ancestor, time_index, end, is_of_region);
            ancestor = chunks_[ancestor].parent;
        }
    }
}

void TouchTable::drop_unused() {
    kept_.clear();
    for (const Chunk& chunk : chunks_) {
        if (chunk.last_used_round == round_) kept_.push_back(chunk);
    }
    chunks_.clear();
    touched_.clear();
    std::fill(index_.begin(), index_.end(), HashEntry{});
    for (const Chunk& chunk : kept_) chunks_[add(chunk.key)].highest = chunk.highest;
    most_chunks_ = 2 * chunks_.size() + kSpareChunks;
}

// The body sweep finds the time intervals in which a moving, growing sphere touches chunks.
//
// It replaces the sphere by its axis-aligned box. For each column and row of chunks it computes the interval of overlap
// in plan, and within that interval the time at which the box is low enough. The sphere itself is tested only at the
// start, and at the corners of squares if it is large. The box adds a few chunks and misses none.
//
// A sphere with a given speed whose radius grows by g t^2 / 2 closes a gap of at most speed t + g t^2 / 2 in t seconds.

namespace {

constexpr double kGravity = 9.81;
constexpr double kNever = std::numeric_limits<double>::infinity();
// Enlargement of the sphere's radius per metre of coordinates, to cover rounding.
constexpr double kRounding = 1e-14;
// Radius, in sides of a chunk, above which corners are tested: a smaller sphere touches most chunks that its box does.
constexpr double kLargeSphere = 0.5;
constexpr double kSqrt2 = 1.4142135623730951;
constexpr double kPi = 3.141592653589793;

// The earliest time at which speed * t + growth * t^2 / 2 reaches `gap`.
double time_to_close(double gap, double speed, double growth) {
    if (gap <= 0.0) return 0.0;
    const double root = std::sqrt(speed * speed + 2.0 * growth * gap);
    if (speed > 0.0) return 2.0 * gap / (speed + root);
    return growth > 0.0 ? (root - speed) / growth : kNever;
}

// Upper estimate of the number of squares that a sphere touches: the area, in squares, within a diagonal of its path.
double square_count(const MotionSegment& segment, double side) {
    const double distance =
        segment.duration > 0.0 ? segment.velocity.head<2>().norm() * segment.duration : 0.0;
    const double growth = 0.5 * segment.growth * segment.duration * segment.duration;
    const double reach = (segment.radius + growth) / side + kSqrt2;
    return (2.0 * distance / side + kPi * reach) * reach;
}

// Shortens a segment until its square_count() is at most `most`; if that does not suffice, also shrinks the sphere.
void truncate(MotionSegment& segment, double side, double most) {
    const double duration = segment.duration;
    segment.duration = 0.0;
    if (square_count(segment, side) > most) {
        segment.radius = std::max(0.0, side * (std::sqrt(most / kPi) - kSqrt2));
        return;
    }
    constexpr int kHalvings = 64;
    for (int i = 1; i <= kHalvings; ++i) {
        segment.duration = std::ldexp(duration, -i);
        if (square_count(segment, side) <= most) return;
    }
    segment.duration = 0.0;
}

// Signed distance from a sphere to the column over a closed square, below `height`; negative if they overlap.
double gap_to(const WorldPos& centre, double radius, const WorldRect& square, double height) {
    const double x = std::max({0.0, square.west - centre.x(), centre.x() - square.east});
    const double y = std::max({0.0, square.south - centre.y(), centre.y() - square.north});
    const double z = std::max(0.0, centre.z() - height);
    return std::sqrt(x * x + y * y + z * z) - radius;
}

// The end of the interval [low, high] beyond which both a and b lie; nothing if there is no such end.
std::optional<double> end_towards(double low, double high, double a, double b) {
    if (a < low && b < low) return low;
    if (a > high && b > high) return high;
    return std::nullopt;
}

}  // namespace

void find_segments(const BodyNeed& body, double time_s, double horizon,
                   std::vector<MotionSegment>& segments_out) {
    segments_out.clear();
    if (body.trajectory.empty()) {
        segments_out.push_back(
            {0.0, horizon, body.centre_world, body.velocity, body.radius, kGravity});
        return;
    }
    MotionSegment segment{.from_world = body.centre_world, .radius = body.radius};
    const auto first =
        std::lower_bound(body.trajectory.begin(), body.trajectory.end(), time_s,
                         [](const BodyMoment& moment, double now) { return moment.time_s < now; });
    for (auto next = first; next != body.trajectory.end(); ++next) {
        const double left = horizon - segment.begin;
        const double wait = std::max(0.0, next->time_s - time_s - segment.begin);
        segment.velocity = Eigen::Vector3d::Zero();
        if (wait > 0.0) segment.velocity = (next->centre_world - segment.from_world) / wait;
        segment.duration = std::min(wait, left);
        segments_out.push_back(segment);
        if (wait > left) return;
        segment.begin += wait;
        segment.from_world = next->centre_world;
    }
    segment.duration = horizon - segment.begin;
    segment.velocity = Eigen::Vector3d::Zero();
    segments_out.push_back(segment);
}

// The extent of the sphere's box along one axis, as a function of time.
struct BodySweep::AxisMotion {
    double from, speed, radius, growth, duration;
    double low_begin, high_begin, low_end, high_end;

    AxisMotion(const MotionSegment& segment, int axis)
        : from(segment.from_world[axis]),
          speed(segment.velocity[axis]),
          radius(segment.radius),
          growth(segment.growth),
          duration(segment.duration),
          low_begin(from - radius),
          high_begin(from + radius),
          low_end(low(duration)),
          high_end(high(duration)) {}

    // low() is concave and high() convex: the minimum of low() and the maximum of high() are at the ends.
    double low(double time) const { return from + speed * time - reach(time); }
    double high(double time) const { return from + speed * time + reach(time); }
    double reach(double time) const { return radius + 0.5 * growth * time * time; }
    double lowest() const { return std::min(low_begin, low_end); }
    double highest() const { return std::max(high_begin, high_end); }

    // The time interval of overlap with [west, east]; if the box leaves it and returns by growing, the gap is included.
    Window over(double west, double east) const {
        Window when{0.0, duration};
        if (high_begin < west) {
            when.enter = time_to_close(west - high_begin, speed, growth);
        } else if (low_begin > east) {
            when.enter = time_to_close(low_begin - east, -speed, growth);
        }
        const bool is_ahead = low_end > east;
        if (is_ahead || high_end < west) {
            // lower bound of the mean speed of the trailing face
            const double distance = is_ahead ? east - low_begin : high_begin - west;
            const double slowest = std::abs(speed) - 0.5 * growth * duration;
            when.leave = std::min(duration, distance / slowest);
        }
        return when;
    }
};

void BodySweep::find_lanes(const ChunkAxis& axis, const ChunkSpan& span, const AxisMotion& motion,
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
    find_highest(source);
    for (const ChunkAxis* axis : {&grid_.x, &grid_.y}) {
        scale_ = std::max({scale_, std::abs(axis->edge(axis->world.first)),
                           std::abs(axis->edge(axis->world.last + 1))});
    }
}

void BodySweep::find_highest(const HeightSource& source) {
    highest_ = source.interval(source.extent()).high + source.lattice().quantum;
}

// Whether the sphere, whose box overlaps a square, passes a corner of the square without touching the square.
bool BodySweep::passes_corner(const MotionSegment& segment, const WorldRect& square,
                              const Window& when) {
    const Eigen::Vector2d from = segment.from_world.head<2>(),
                          velocity = segment.velocity.head<2>();
    const Eigen::Vector2d begin = from + when.enter * velocity, end = from + when.leave * velocity;
    const auto x = end_towards(square.west, square.east, begin.x(), end.x());
    if (!x) return false;
    const auto y = end_towards(square.south, square.north, begin.y(), end.y());
    if (!y) return false;
    // the corner is the nearest point of the square during the whole window
    const Eigen::Vector2d corner(*x, *y);
    const double nearest = (corner - from).dot(velocity) / velocity.squaredNorm();
    const double time = nearest > when.enter ? std::min(nearest, when.leave) : when.enter;
    const double reach = segment.radius + 0.5 * segment.growth * when.leave * when.leave;
    return (from + time * velocity - corner).squaredNorm() > reach * reach;
}

BodySweep::Cost BodySweep::find(MotionSegment segment, double most, TouchTable& table,
                                std::vector<Touch>& touches_out) {
    touches_out.clear();
    // finds the columns and rows that the box overlaps, if it is ever low enough
    ChunkSpan columns, rows;
    const auto find_spans = [&] {
        columns = rows = {};
        const AxisMotion x(segment, 0), y(segment, 1);
        if (AxisMotion(segment, 2).lowest() > highest_) return;
        columns = grid_.x.touched(x.lowest(), x.highest(), columns_);
        rows = grid_.y.touched(y.lowest(), y.highest(), rows_);
    };
    // margin for the rounding of coordinates
    segment.radius +=
        kRounding * (segment.from_world.cwiseAbs().maxCoeff() + scale_ + segment.radius);
    find_spans();
    Cost cost;
    if (columns.count() * rows.count() > most && square_count(segment, grid_.x.side) > most) {
        truncate(segment, grid_.x.side, most);
        find_spans();
        cost.is_truncated = true;
    }
    if (columns.count() == 0.0 || rows.count() == 0.0) return cost;

    find_lanes(grid_.x, columns, AxisMotion(segment, 0), column_lanes_);
    find_lanes(grid_.y, rows, AxisMotion(segment, 1), row_lanes_);
    Window in_columns{kNever, -kNever};
    for (const Lane& column : column_lanes_) {
        in_columns.enter = std::min(in_columns.enter, column.when.enter);
        in_columns.leave = std::max(in_columns.leave, column.when.leave);
    }
    const AxisMotion z(segment, 2);
    const Eigen::Vector3d& v = segment.velocity;
    const double speed = std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
    const double large = kLargeSphere * grid_.x.side;
    std::size_t first = 0;
    for (std::size_t j = 0; j < row_lanes_.size(); ++j) {
        const Lane& row = row_lanes_[j];
        cost.squares += 1.0;
        if (row.when.intersect(in_columns).is_empty()) continue;
        // columns that the box overlaps within a row are contiguous; adjacent rows have at least one of them in common
        const auto is_over = [&](std::size_t i) {
            return !row.when.intersect(column_lanes_[i].when).is_empty();
        };
        while (first + 1 < column_lanes_.size() && !is_over(first)) ++first;
        while (first > 0 && is_over(first - 1)) --first;
        for (std::size_t i = first; i < column_lanes_.size(); ++i) {
            const Lane& column = column_lanes_[i];
            const Window when = row.when.intersect(column.when);
            if (when.is_empty()) break;
            cost.squares += 1.0;
            const WorldRect square{column.low, row.low, column.high, row.high};
            if (z.reach(when.leave) > large && passes_corner(segment, square, when)) continue;
            const TouchTable::Slot slot =
                table.slot(static_cast<std::int32_t>(columns.first + static_cast<std::int64_t>(i)),
                           static_cast<std::int32_t>(rows.first + static_cast<std::int64_t>(j)));
            const double height = table.highest(slot);
            double time = when.enter;
            if (time == 0.0) {
                time = time_to_close(gap_to(segment.from_world, segment.radius, square, height),
                                     speed, segment.growth);
            }
            if (const double gap = z.low(time) - height; gap > 0.0) {
                time += time_to_close(gap, segment.growth * time - z.speed, segment.growth);
            }
            const double last = when.leave < segment.duration ? when.leave : kNever;
            if (time <= when.leave) touches_out.push_back({slot, time, last});
        }
    }
    return cost;
}

namespace {
constexpr double kBelowAllGround = -0x1p38;  // metres: lower bound of all heights
}  // namespace

ContactNeeds::ContactNeeds(const HeightSource& source, int contact_level)
    : source_(source),
      grid_(source.lattice(), contact_level),
      sweep_(source, contact_level),
      table_(source, contact_level) {}

void ContactNeeds::forget_heights() {
    sweep_.find_highest(source_);
    table_.forget_heights();
}

void ContactNeeds::find(std::span<const BodyNeed> bodies, std::span<const RegionNeed> regions,
                        double time_s, double horizon) {
    TERRANE_ASSERT(horizon >= 0.0, "horizon must be >= 0 s");
    table_.clear();
    current_contacts_.clear();
    is_cut_ = false;
    collect_times(regions, time_s, horizon);
    const double share =
        std::max(kLeastShare, kMostSquares / std::max(1.0, static_cast<double>(bodies.size())));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        find_body(i, bodies[i], time_s, horizon, share);
    }
    double left = kMostSquares;
    for (const Deadline& deadline : deadlines_) {
        const auto time_index = std::lower_bound(times_.begin(), times_.end(), deadline.time);
        left -= touch_region(regions[deadline.region].region,
                             static_cast<TouchTable::TimeIndex>(time_index - times_.begin()), left);
    }
    table_.touch_ancestors();
}

std::vector<ContactNeeds::Entry> ContactNeeds::entries() const {
    std::vector<Entry> entries;
    for (const Slot slot : table_.touched()) {
        entries.push_back({table_.key(slot), time_until(slot)});
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        if (a.time != b.time) return a.time < b.time;
        return a.key.level != b.key.level ? a.key.level < b.key.level : a.key < b.key;
    });
    return entries;
}

// Merges the steps of the horizon with the deadlines.
void ContactNeeds::collect_times(std::span<const RegionNeed> regions, double time_s,
                                 double horizon) {
    deadlines_.clear();
    for (std::size_t i = 0; i < regions.size(); ++i) {
        deadlines_.push_back({std::max(0.0, regions[i].deadline_s - time_s), i});
    }
    std::sort(deadlines_.begin(), deadlines_.end(), [](const Deadline& a, const Deadline& b) {
        return std::tie(a.time, a.region) < std::tie(b.time, b.region);
    });
    times_.clear();
    const auto add = [this](double time) {
        if (times_.empty() || time > times_.back()) times_.push_back(time);
    };
    auto deadline = deadlines_.begin();
    for (std::size_t step = 0; step < kSteps; ++step) {
        const double time = horizon * static_cast<double>(step) / kSteps;
        for (; deadline != deadlines_.end() && deadline->time <= time; ++deadline) {
            add(deadline->time);
        }
        add(time);
        step_times_[step] = static_cast<TouchTable::TimeIndex>(times_.size() - 1);
    }
    for (; deadline != deadlines_.end(); ++deadline) add(deadline->time);
}

void ContactNeeds::find_body(std::size_t index, const BodyNeed& body, double time_s, double horizon,
                             double most) {
    find_segments(body, time_s, horizon, segments_);
    if (body.is_waiting) segments_.front().from_world.z() = kBelowAllGround;
    const double steps = horizon > 0.0 ? kSteps / horizon : 0.0;  // per second
    for (const MotionSegment& segment : segments_) {
        const BodySweep::Cost cost = sweep_.find(segment, most, table_, touches_);
        const bool is_here =
            &segment == segments_.data();  // after a jump other segments may also start now
        const bool is_end = cost.is_truncated || &segment == &segments_.back();
        for (const Touch& touch : touches_) {
            const double step = std::min((segment.begin + touch.time) * steps, kSteps - 1.0);
            const double end =
                !is_end && touch.last > segment.duration ? segment.duration : touch.last;
            table_.touch(touch.slot, step_times_[static_cast<std::size_t>(step)],
                         segment.begin + end, false);
            if (is_here && touch.time == 0.0)
                current_contacts_.push_back({index, table_.key(touch.slot)});
        }
        most -= cost.squares;
        is_cut_ = is_cut_ || cost.is_truncated;
        if (cost.is_truncated) return;
    }
}

// Returns the number of touched chunks.
double ContactNeeds::touch_region(const WorldRect& region, TouchTable::TimeIndex time_index,
                                  double most) {
    const ChunkSpan columns = grid_.x.touched(region.west, region.east, grid_.x.world);
    const ChunkSpan rows = grid_.y.touched(region.south, region.north, grid_.y.world);
    double count = 0.0;
    for (std::int64_t row = rows.first; row <= rows.last; ++row) {
        for (std::int64_t column = columns.first; column <= columns.last; ++column) {
            if (count >= most) {
                is_cut_ = true;
                return count;
            }
            count += 1.0;
            table_.touch(
                table_.slot(static_cast<std::int32_t>(column), static_cast<std::int32_t>(row)),
                time_index, std::numeric_limits<double>::infinity(), true);
        }
    }
    return count;
}

double ContactNeeds::time_until(const ChunkKey& key) const {
    const Slot slot = find_slot(key);
    return slot == kNone ? std::numeric_limits<double>::infinity() : time_until(slot);
}

}  // namespace terrane::internal
