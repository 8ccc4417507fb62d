// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// The touched chunks of one level and their ancestors, each with its first and last touch. First touches are indices
/// into the caller's ascending list of times.
///
/// The highest ground of chunks in use is cached across clear(). The cache does not affect results.
///
/// Allocates: when the table grows
class TouchTable {
public:
    using Slot = std::uint32_t;
    using TimeIndex = std::uint32_t;
    static constexpr TimeIndex kNever = std::numeric_limits<TimeIndex>::max();
    static constexpr Slot kNone = std::numeric_limits<Slot>::max();

    /// The source must outlive the table.
    TouchTable(const HeightSource& source, int level);

    /// Removes all touches and invalidates slots.
    void clear();

    /// The slot of a chunk of the level, added if needed. Requires a chunk of the world.
    Slot slot(std::int32_t x, std::int32_t y) {
        const ChunkKey key{x, y, level_};
        Slot slot = index_[bucket_of(key)].slot;
        if (slot == kNone) slot = add(key);
        chunks_[slot].last_used_round = round_;
        return slot;
    }

    /// Invalidates cached heights; call when the source's intervals have changed.
    void forget_heights() {
        for (Chunk& chunk : chunks_) chunk.highest = kUnknown;
    }

    /// Upper bound of the samples of a chunk, metres.
    double highest(Slot slot) {
        Chunk& chunk = chunks_[slot];
        if (chunk.highest == kUnknown) chunk.highest = find_highest(chunk.key);
        return chunk.highest;
    }

    /// Records a touch: keeps the earliest time index and the latest end, seconds, and whether any is of a region.
    void touch(Slot slot, TimeIndex time_index, double end, bool is_of_region) {
        Chunk& chunk = chunks_[slot];
        if (chunk.time_index == kNever) {
            touched_.push_back(slot);
            chunk.time_index = time_index;
            chunk.end = end;
            chunk.is_of_region = is_of_region;
            return;
        }
        chunk.time_index = std::min(chunk.time_index, time_index);
        chunk.end = std::max(chunk.end, end);
        chunk.is_of_region = chunk.is_of_region || is_of_region;
    }

    /// Propagates touches to ancestors. Call it after the last touch().
    void touch_ancestors();

    const ChunkKey& key(Slot slot) const { return chunks_[slot].key; }
    /// The slot of a chunk, kNone if it is not in the table.
    Slot find(const ChunkKey& key) const { return index_[bucket_of(key)].slot; }
    /// The slot of a chunk's child, kNone if it is not in the table.
    Slot child(Slot slot, int quadrant) const {
        return chunks_[slot].child[static_cast<std::size_t>(quadrant)];
    }
    /// Time index of the first touch; kNever if the chunk is not touched.
    TimeIndex time_index(Slot slot) const { return chunks_[slot].time_index; }
    /// End of the last touch of a touched chunk, seconds.
    double end(Slot slot) const { return chunks_[slot].end; }
    /// Whether a region touches a touched chunk.
    bool is_of_region(Slot slot) const { return chunks_[slot].is_of_region; }
    /// The touched chunks, unordered.
    std::span<const Slot> touched() const { return touched_; }

private:
    static constexpr double kUnknown = std::numeric_limits<double>::infinity();
    struct Chunk {
        ChunkKey key;
        TimeIndex time_index = kNever;
        double end = 0.0;           // if touched
        bool is_of_region = false;  // likewise
        Slot parent = kNone;
        std::array<Slot, 4> child{kNone, kNone, kNone, kNone};
        std::uint32_t last_used_round = 0;  // round_ at the last slot()
        double highest = kUnknown;
    };

    struct HashEntry {
        ChunkKey key;
        Slot slot = kNone;
    };

    // Position in index_ of a key's entry, or of the free entry where the key belongs.
    std::size_t bucket_of(const ChunkKey& key) const {
        const std::size_t mask = index_.size() - 1;
        std::size_t at = ChunkKeyHash{}(key)&mask;
        while (index_[at].slot != kNone && index_[at].key != key) at = (at + 1) & mask;
        return at;
    }
    Slot add(const ChunkKey& key);
    double find_highest(const ChunkKey& key) const;
    void drop_unused();

    const HeightSource& source_;
    std::uint8_t level_;
    std::vector<Chunk> chunks_;
    std::vector<HashEntry> index_;  // open addressing; its size is a power of two
    std::vector<Slot> touched_;     // unordered
    std::vector<Chunk> kept_;
    std::uint32_t round_ = 1;      // counts clear()
    std::size_t most_chunks_ = 0;  // above this clear() drops unused chunks
};

/// A range of columns or rows of chunks, both ends included; empty if last < first.
struct ChunkSpan {
    std::int64_t first = 0;
    std::int64_t last = -1;

    double count() const { return std::max(0.0, static_cast<double>(last - first) + 1.0); }
};

/// The columns or the rows of the chunks of one level.
struct ChunkAxis {
    double origin = 0.0;  ///< world coordinate of lattice index 0, metres
    double side = 1.0;    ///< side of a chunk, metres
    double inverse_side = 1.0;
    ChunkSpan world;  ///< all columns or rows of the world

    /// The western or southern edge of a chunk, bit-identical to Lattice::x() and y().
    double edge(std::int64_t index) const { return origin + side * static_cast<double>(index); }

    /// Columns or rows in `within` that share a point with the closed interval [low, high]. Unspecified for NaN.
    ChunkSpan touched(double low, double high, const ChunkSpan& within) const {
        std::int64_t first = index_at(low, within), last = index_at(high, within);
        // the index may be off by one, and neighbours share their edge
        if (edge(first + 1) < low) ++first;
        if (edge(first) >= low) --first;
        if (edge(last) > high) --last;
        if (edge(last + 1) <= high) ++last;
        return {std::max(first, within.first), std::min(last, within.last)};
    }

private:
    // The column or row at a coordinate, clamped to at most two beyond the span so that it fits an integer.
    std::int64_t index_at(double place, const ChunkSpan& within) const {
        const double index = (place - origin) * inverse_side;
        if (!(index > static_cast<double>(within.first - 2))) return within.first - 2;
        if (!(index < static_cast<double>(within.last + 2))) return within.last + 2;
        const auto cut = static_cast<std::int64_t>(index);
        return static_cast<double>(cut) > index ? cut - 1 : cut;
    }
};

/// The chunks of one level.
struct ChunkGrid {
    ChunkGrid(const Lattice& lattice, int level)
        : x{lattice.origin_x,
            lattice.level_spacing(level) * kChunkCells,
            1.0 / (lattice.level_spacing(level) * kChunkCells),
            {}},
          y{lattice.origin_y, x.side, x.inverse_side, {}} {
        const auto span = [level](std::int32_t first_root, std::int32_t root_count) {
            const std::int64_t first = std::int64_t{first_root} << level;
            return ChunkSpan{first, first + (std::int64_t{root_count} << level) - 1};
        };
        x.world = span(lattice.first_root_x, lattice.root_count_x);
        y.world = span(lattice.first_root_y, lattice.root_count_y);
    }

    ChunkAxis x, y;
};

/// A piece of a body's predicted path: its bounding sphere, moving at constant velocity. The radius grows by
/// growth t^2 / 2, an allowance for the deviation from the straight line (mainly free fall).
struct MotionSegment {
    double begin = 0.0;     ///< seconds from now
    double duration = 0.0;  ///< seconds
    WorldPos from_world = WorldPos::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double radius = 0.0;
    double growth = 0.0;  ///< m/s^2; 0 along a given trajectory
};

/// Splits the motion of a body over the horizon into segments. A given trajectory starts at the body's current
/// position, skips moments in the past, and ends at rest at its last moment.
///
/// @param segments_out replaced; at least one segment, in order of time
void find_segments(const BodyNeed& body, double time_s, double horizon,
                   std::vector<MotionSegment>& segments_out);

/// A chunk touched by a segment's sphere.
struct Touch {
    TouchTable::Slot slot;
    double time = 0.0;  ///< lower bound of the first touch, seconds since the segment's start
    /// Upper bound of the last touch, seconds since the segment's start; infinite if the (possibly truncated) segment
    /// ends over the chunk.
    double last = 0.0;
};

/// Finds the chunks that motion segments touch. A chunk is represented by the column over its closed square, from the
/// highest ground in the square downwards without limit. Conservative: also finds some chunks that are narrowly missed.
class BodySweep {
public:
    /// The source must outlive the sweep.
    BodySweep(const HeightSource& source, int level);

    struct Cost {
        double squares = 0.0;       ///< squares tested
        bool is_truncated = false;  ///< the segment was shortened to stay within the limit
    };

    /// @param most         approximate number of squares to test; a longer segment is truncated at its end, and a
    ///                     sphere that is too large is shrunk about its centre
    /// @param table        caches the heights of chunks
    /// @param touches_out  replaced; each chunk once
    Cost find(MotionSegment segment, double most, TouchTable& table,
              std::vector<Touch>& touches_out);

    /// Updates the upper bound of all ground; call when the source's intervals have changed.
    void find_highest(const HeightSource& source);

private:
    /// The time interval in which the sphere's box overlaps a column or a row.
    struct Window {
        double enter, leave;
        bool is_empty() const { return enter > leave; }
        Window intersect(const Window& other) const {
            return {std::max(enter, other.enter), std::min(leave, other.leave)};
        }
    };
    /// A column or a row of chunks.
    struct Lane {
        double low, high;  // its edges
        Window when;
    };
    struct AxisMotion;
    static void find_lanes(const ChunkAxis& axis, const ChunkSpan& span, const AxisMotion& motion,
                           std::vector<Lane>& lanes_out);
    static bool passes_corner(const MotionSegment& segment, const WorldRect& square,
                              const Window& when);

    ChunkGrid grid_;
    ChunkSpan columns_, rows_;  // those that contain ground
    double highest_ = 0.0;      // upper bound of all ground, metres
    double scale_ = 0.0;        // largest chunk coordinate, metres
    std::vector<Lane> column_lanes_, row_lanes_;
};

/// A required rectangle.
struct RegionNeed {
    WorldRect region;
    double deadline_s = 0.0;
};

/// The chunks of the contact level touched by bodies and regions, and their ancestors, with times of first and last
/// touch.
///
/// A body is a sphere that moves with the body's velocity and whose radius grows by g t^2 / 2, an allowance for the
/// deviation from the straight line (mainly free fall); along a given trajectory it does not grow. The sphere touches a
/// chunk if it shares a point with the column over the chunk's closed square, from the highest ground in the square
/// downwards. Bodies touch nothing beyond the source's extent. A region touches all chunks of the world that share a
/// point with it, at its deadline, which may be beyond the horizon.
///
/// Times are seconds from now. The first time is a lower bound of the first touch; for bodies it is rounded down to one
/// of kSteps steps of the horizon. The last time is an upper bound of the last touch; it is infinite for regions and
/// for chunks that are touched at the end of the horizon.
///
/// Answers are a pure function of the source and the arguments of the last find().
/// Allocates: when it needs more memory than ever before
class ContactNeeds {
public:
    static constexpr std::size_t kSteps = 256;
    /// Approximate limit on squares tested for all bodies together, and again for all regions. Bodies have equal shares
    /// of at least kLeastShare. A motion that would exceed its share is cut off at its end; a sphere that is too large
    /// for its share is shrunk about its centre.
    static constexpr double kMostSquares = 131072.0;
    static constexpr double kLeastShare = 128.0;

    struct Entry {
        ChunkKey key;
        double time = 0.0;
    };
    /// A body and a chunk of the contact level that it currently touches.
    struct CurrentContact {
        std::size_t body = 0;  ///< index in the list
        ChunkKey key;
    };

    /// The source must outlive this object.
    ContactNeeds(const HeightSource& source, int contact_level);

    /// Recomputes the needs of bodies and regions. Requires finite bodies and regions, which Pager ensures; deadlines
    /// may be infinite.
    ///
    /// @param time_s   current time, on the clock of trajectories and deadlines
    /// @param horizon  seconds, >= 0
    ///
    /// Cost: about 10 ns per chunk and body
    void find(std::span<const BodyNeed> bodies, std::span<const RegionNeed> regions, double time_s,
              double horizon);

    /// Invalidates cached heights; call when the source's intervals have changed. Cost: O(chunks held)
    void forget_heights();

    /// The touches of one chunk: a handle for a traversal from parents to children. Valid until the next find().
    using Slot = TouchTable::Slot;
    static constexpr Slot kNone = TouchTable::kNone;  ///< nothing touches the chunk
    /// The touches of a chunk, or kNone.
    Slot find_slot(const ChunkKey& key) const { return touched(table_.find(key)); }
    /// The touches of a chunk's child, or kNone. An untouched chunk has no touched descendants.
    Slot child(Slot slot, int quadrant) const {
        return slot == kNone ? kNone : touched(table_.child(slot, quadrant));
    }
    /// First touch, seconds from now. Requires touches.
    double time_until(Slot slot) const { return times_[table_.time_index(slot)]; }
    /// Last touch, seconds from now. Requires touches.
    double end_of(Slot slot) const { return table_.end(slot); }
    /// Whether a region touches the chunk. Requires touches.
    bool is_of_region(Slot slot) const { return table_.is_of_region(slot); }

    /// First touch of a chunk, seconds from now; infinite if nothing touches it.
    double time_until(const ChunkKey& key) const;
    /// Last touch of a chunk, seconds from now. Requires a touched chunk.
    double end_of(const ChunkKey& key) const { return table_.end(table_.find(key)); }

    /// All touched chunks, each once, ordered by first touch, level and key. An ancestor has the smallest time of its
    /// descendants. Allocates.
    std::vector<Entry> entries() const;

    /// Touches of bodies at the present time, at the contact level, ordered by body. Valid until the next find().
    std::span<const CurrentContact> current_contacts() const { return current_contacts_; }

    /// Whether needs were truncated at the limits above.
    bool is_cut() const { return is_cut_; }

private:
    void collect_times(std::span<const RegionNeed> regions, double time_s, double horizon);
    void find_body(std::size_t index, const BodyNeed& body, double time_s, double horizon,
                   double most);
    double touch_region(const WorldRect& region, TouchTable::TimeIndex time_index, double most);
    Slot touched(Slot slot) const {
        return slot != kNone && table_.time_index(slot) != TouchTable::kNever ? slot : kNone;
    }

    const HeightSource& source_;
    ChunkGrid grid_;
    BodySweep sweep_;
    TouchTable table_;
    std::vector<double> times_;  // possible first touches, increasing
    std::array<TouchTable::TimeIndex, kSteps> step_times_{};
    struct Deadline {
        double time;
        std::size_t region;
    };
    std::vector<Deadline> deadlines_;
    std::vector<MotionSegment> segments_;
    std::vector<Touch> touches_;
    std::vector<CurrentContact> current_contacts_;
    bool is_cut_ = false;
};

}  // namespace terrane::internal
