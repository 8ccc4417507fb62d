// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/body_sweep.h"
#include "paging/demand/touch_table.h"

#include <terrane/terrain/pager.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace terrane::internal {

/// A rectangle required by a ticket.
struct RegionNeed {
    WorldRect region;
    double deadline_s = 0.0;
};

/// The chunks of the contact level that bodies and regions touch, with their ancestors: when first, and
/// until when.
///
/// A body is a sphere that moves with its velocity and grows by g t^2 / 2, because gravity or an impact may
/// take it off the straight line; with a given trajectory it follows that and does not grow. It touches a
/// chunk if it shares a point with the column of the chunk's closed square up to the highest ground in it,
/// also from below. Beyond the source's extent nothing is touched. A region touches, at its deadline, all
/// chunks of the world that share a point with it, whatever the horizon.
///
/// Times are seconds from now. The first is a lower bound of the first touch, for bodies rounded down to
/// kSteps of the horizon; the last is an upper bound of the last touch, infinite for regions and for what is
/// touched at the end of the horizon.
///
/// Answers are a pure function of the source and the arguments of the last find().
/// Allocates: where it needs more memory than ever before
class ContactNeeds {
public:
    static constexpr std::size_t kSteps = 256;
    /// Squares that all bodies together may test, about, and the same for all regions. Each body has an
    /// equal share, at least kLeastShare. What would exceed it is truncated to what comes first, or is nearest
    /// to the body.
    static constexpr double kMostSquares = 131072.0;
    static constexpr double kLeastShare = 128.0;

    struct Entry {
        ChunkKey key;
        double time = 0.0;
    };
    /// A body and a chunk of the contact level that it touches now.
    struct CurrentContact {
        std::size_t body = 0;  ///< index in the list
        ChunkKey key;
    };

    /// The source outlives it.
    ContactNeeds(const HeightSource& source, int contact_level);

    /// Replaces bodies and regions. Requires finite ones, which Pager::update() ensures; deadlines may be
    /// infinite.
    ///
    /// @param time_s   now, on the clock of moments and deadlines
    /// @param horizon  seconds, >= 0
    ///
    /// Cost: some 10 ns for each chunk and body
    void find(std::span<const BodyNeed> bodies, std::span<const RegionNeed> regions, double time_s,
              double horizon);

    /// Call when the source's intervals have changed. Cost: O(chunks held)
    void forget_heights();

    /// First touch of a chunk; infinite where nothing touches it.
    double time_until(const ChunkKey& key) const;

    /// Last touch of a chunk. Requires a touched one.
    double end_of(const ChunkKey& key) const { return table_.end(key); }

    /// All touched chunks, each once, ordered by first touch, level and key. The time of an ancestor is the
    /// least of its descendants'. Valid until the next find().
    std::span<const Entry> entries() const { return entries_; }

    /// The touches of this instant at the contact level, ordered by body. Valid until the next find().
    std::span<const CurrentContact> current_contacts() const { return current_contacts_; }

    /// Whether something was left out because it exceeded the limits above.
    bool is_cut() const { return is_cut_; }

private:
    void collect_times(std::span<const RegionNeed> regions, double time_s, double horizon);
    void find_body(std::size_t index, const BodyNeed& body, double time_s, double horizon,
                   double most);
    double touch_region(const WorldRect& region, TouchTable::TimeIndex time_index, double most);

    const HeightSource& source_;
    ChunkGrid grid_;
    BodySweep sweep_;
    TouchTable table_;
    std::vector<double> times_;  // of first touches, increasing
    std::array<TouchTable::TimeIndex, kSteps> step_times_{};
    struct Deadline {
        double time;
        std::size_t region;
    };
    std::vector<Deadline> deadlines_;
    std::vector<MotionSegment> segments_;
    std::vector<Touch> touches_;
    std::vector<TouchTable::Slot> order_;
    std::vector<Entry> entries_;
    std::vector<CurrentContact> current_contacts_;
    bool is_cut_ = false;
};

}  // namespace terrane::internal
