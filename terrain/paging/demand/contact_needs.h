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

/// A rectangle that was asked for by name.
struct RegionNeed {
    WorldRect region;
    double deadline_s = 0.0;
};

/// Which chunks of the contact level, and which ancestors of theirs, bodies and regions touch, when
/// first and until when.
///
/// A body is a ball that follows its velocity and grows by g t^2 / 2, because gravity or an impact may
/// take it off the straight line; where its way is known it follows that, and does not grow. It touches
/// a chunk where it shares a point with what lies in the chunk's closed square and not above the highest
/// ground there: from below, too. Beyond the source's extent there is nothing to touch. A region
/// touches, at its deadline, all chunks of the world that share a point with it, whatever the horizon.
///
/// Times are seconds from now. The first is never later than the first touch, and those of bodies are
/// rounded down to kSteps of the horizon; the last is never earlier than the last touch, and infinite
/// for regions and for what is touched where the horizon ends.
///
/// Answers are a pure function of the source and the arguments of the last find().
/// Allocates: while it grows
class ContactNeeds {
public:
    static constexpr std::size_t kSteps = 256;
    /// Squares that all bodies together may look at, about, and all regions; each body has an equal
    /// share, but no less than the least one: a crowd pays for what it is. Of what would take more only
    /// what comes first, or is nearest to the body, counts.
    static constexpr double kMostSquares = 131072.0;
    static constexpr double kLeastShare = 128.0;

    struct Entry {
        ChunkKey key;
        double time = 0.0;
    };
    /// A body that touches a chunk now.
    struct Stand {
        std::size_t body = 0;  ///< index in the list
        ChunkKey key;
    };

    /// The source outlives it.
    ContactNeeds(const HeightSource& source, int contact_level);

    /// Takes bodies and regions in the place of those before. They are finite, as Pager::update() sees
    /// to, but for deadlines, which may be infinite.
    ///
    /// @param time_s   now, on the clock of moments and deadlines
    /// @param horizon  seconds, >= 0
    ///
    /// Cost: some 10 ns for each chunk and body
    void find(std::span<const BodyNeed> bodies, std::span<const RegionNeed> regions, double time_s,
              double horizon);

    /// When a chunk is touched first; infinity where nothing touches it, or nothing knows it.
    double time_until(const ChunkKey& key) const;

    /// When a chunk that is touched is touched last.
    double end_of(const ChunkKey& key) const { return table_.end(key); }

    /// All that is touched, each once, ordered by time, level and key. The time of an ancestor is the
    /// least of those below it. Valid until the next find().
    std::span<const Entry> entries() const { return entries_; }

    /// Who touches what at this moment, at the contact level, ordered by body. Valid until the next
    /// find().
    std::span<const Stand> stands() const { return stands_; }

    /// Whether something was left out because it would have been too much.
    bool is_cut() const { return is_cut_; }

private:
    void lay_out_moments(std::span<const RegionNeed> regions, double time_s, double horizon);
    void find_body(std::size_t index, const BodyNeed& body, double time_s, double horizon,
                   double most);
    double touch_region(const WorldRect& region, TouchTable::Moment moment, double most);

    ChunkGrid grid_;
    BodySweep sweep_;
    TouchTable table_;
    std::vector<double> moments_;  // that something may be touched at, rising
    std::array<TouchTable::Moment, kSteps> step_moments_{};
    struct Deadline {
        double time;
        std::size_t region;
    };
    std::vector<Deadline> deadlines_;
    std::vector<Leg> legs_;
    std::vector<Touch> touches_;
    std::vector<TouchTable::Slot> order_;
    std::vector<Entry> entries_;
    std::vector<Stand> stands_;
    bool is_cut_ = false;
};

}  // namespace terrane::internal
