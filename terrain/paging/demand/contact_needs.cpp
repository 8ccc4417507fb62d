// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <limits>
#include <tuple>

namespace terrane::internal {
namespace {
constexpr double kBelowAllGround = -0x1p38;  // metres: heights are within that
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
    table_.sort(times_.size(), order_);
    entries_.clear();
    for (const TouchTable::Slot slot : order_) {
        entries_.push_back({table_.key(slot), times_[table_.time_index(slot)]});
    }
}

// The steps of the horizon merged with the deadlines.
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
    const double steps = horizon > 0.0 ? kSteps / horizon : 0.0;  // a second
    for (const MotionSegment& segment : segments_) {
        const BodySweep::Cost cost = sweep_.find(segment, most, table_, touches_);
        const bool is_here =
            &segment == segments_.data();  // after a jump others may begin now, too
        const bool is_end = cost.is_truncated || &segment == &segments_.back();
        for (const Touch& touch : touches_) {
            const double step = std::min((segment.begin + touch.time) * steps, kSteps - 1.0);
            const double end =
                !is_end && touch.last > segment.duration ? segment.duration : touch.last;
            table_.touch(touch.slot, step_times_[static_cast<std::size_t>(step)],
                         segment.begin + end);
            if (is_here && touch.time == 0.0)
                current_contacts_.push_back({index, table_.key(touch.slot)});
        }
        most -= cost.squares;
        is_cut_ = is_cut_ || cost.is_truncated;
        if (cost.is_truncated) return;
    }
}

// Returns the number of chunks touched.
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
                time_index, std::numeric_limits<double>::infinity());
        }
    }
    return count;
}

double ContactNeeds::time_until(const ChunkKey& key) const {
    const TouchTable::TimeIndex time_index = table_.time_index(key);
    return time_index == TouchTable::kNever ? std::numeric_limits<double>::infinity()
                                            : times_[time_index];
}

}  // namespace terrane::internal
