// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <limits>
#include <tuple>

namespace terrane::internal {

ContactNeeds::ContactNeeds(const HeightSource& source, int contact_level)
    : grid_(source.lattice(), contact_level),
      sweep_(source, contact_level),
      table_(source, contact_level) {}

void ContactNeeds::find(std::span<const BodyNeed> bodies, std::span<const RegionNeed> regions,
                        double time_s, double horizon) {
    TERRANE_ASSERT(horizon >= 0.0, "horizon must be >= 0 s");
    table_.clear();
    stands_.clear();
    is_cut_ = false;
    lay_out_moments(regions, time_s, horizon);
    const double share =
        std::max(kLeastShare, kMostSquares / std::max(1.0, static_cast<double>(bodies.size())));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        find_body(i, bodies[i], time_s, horizon, share);
    }
    double left = kMostSquares;
    for (const Deadline& deadline : deadlines_) {
        const auto moment = std::lower_bound(moments_.begin(), moments_.end(), deadline.time);
        left -= touch_region(regions[deadline.region].region,
                             static_cast<TouchTable::Moment>(moment - moments_.begin()), left);
    }
    table_.touch_ancestors();
    table_.sort(moments_.size(), order_);
    entries_.clear();
    for (const TouchTable::Slot slot : order_) {
        entries_.push_back({table_.key(slot), moments_[table_.moment(slot)]});
    }
}

// The steps of the horizon, with the deadlines between them.
void ContactNeeds::lay_out_moments(std::span<const RegionNeed> regions, double time_s,
                                   double horizon) {
    deadlines_.clear();
    for (std::size_t i = 0; i < regions.size(); ++i) {
        deadlines_.push_back({std::max(0.0, regions[i].deadline_s - time_s), i});
    }
    std::sort(deadlines_.begin(), deadlines_.end(), [](const Deadline& a, const Deadline& b) {
        return std::tie(a.time, a.region) < std::tie(b.time, b.region);
    });
    moments_.clear();
    const auto add = [this](double time) {
        if (moments_.empty() || time > moments_.back()) moments_.push_back(time);
    };
    auto deadline = deadlines_.begin();
    for (std::size_t step = 0; step < kSteps; ++step) {
        const double time = horizon * static_cast<double>(step) / kSteps;
        for (; deadline != deadlines_.end() && deadline->time <= time; ++deadline) {
            add(deadline->time);
        }
        add(time);
        step_moments_[step] = static_cast<TouchTable::Moment>(moments_.size() - 1);
    }
    for (; deadline != deadlines_.end(); ++deadline) add(deadline->time);
}

void ContactNeeds::find_body(std::size_t index, const BodyNeed& body, double time_s, double horizon,
                             double most) {
    find_legs(body, time_s, horizon, legs_);
    const double steps = horizon > 0.0 ? kSteps / horizon : 0.0;  // a second
    for (const Leg& leg : legs_) {
        const BodySweep::Looks looks = sweep_.find(leg, most, table_, touches_);
        const bool is_here = &leg == legs_.data();  // others may begin now, behind a jump
        const bool is_end = looks.is_cut || &leg == &legs_.back();
        for (const Touch& touch : touches_) {
            const double step = std::min((leg.begin + touch.time) * steps, kSteps - 1.0);
            const double end = !is_end && touch.last > leg.duration ? leg.duration : touch.last;
            table_.touch(touch.slot, step_moments_[static_cast<std::size_t>(step)],
                         leg.begin + end);
            if (is_here && touch.time == 0.0) stands_.push_back({index, table_.key(touch.slot)});
        }
        most -= looks.squares;
        is_cut_ = is_cut_ || looks.is_cut;
        if (looks.is_cut) return;
    }
}

// Returns how many chunks it touched.
double ContactNeeds::touch_region(const WorldRect& region, TouchTable::Moment moment, double most) {
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
                moment, std::numeric_limits<double>::infinity());
        }
    }
    return count;
}

double ContactNeeds::time_until(const ChunkKey& key) const {
    const TouchTable::Moment moment = table_.moment(key);
    return moment == TouchTable::kNever ? std::numeric_limits<double>::infinity()
                                        : moments_[moment];
}

}  // namespace terrane::internal
