// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// The chunks of one level that are touched, and their ancestors, each with its first and last touch. First
/// touches are indices into the caller's list of times: a smaller one is earlier.
///
/// The highest ground of chunks and their order are cached from one clear() to the next, while they are used;
/// that changes no answer.
///
/// Allocates: while it grows
class TouchTable {
public:
    using Slot = std::uint32_t;
    using TimeIndex = std::uint32_t;
    static constexpr TimeIndex kNever = std::numeric_limits<TimeIndex>::max();

    /// The source outlives it.
    TouchTable(const HeightSource& source, int level);

    /// Removes all touches and invalidates slots.
    void clear();

    /// The slot of a chunk of the level. Requires a chunk of the world.
    Slot slot(std::int32_t x, std::int32_t y) {
        const ChunkKey key{x, y, level_};
        Slot slot = index_[bucket_of(key)].slot;
        if (slot == kNone) slot = add(key);
        chunks_[slot].last_used_round = round_;
        return slot;
    }

    /// Call when the source's intervals have changed.
    void forget_heights() {
        for (Chunk& chunk : chunks_) chunk.highest = kUnknown;
    }

    /// Upper bound of the samples of a chunk, metres.
    double highest(Slot slot) {
        Chunk& chunk = chunks_[slot];
        if (chunk.highest == kUnknown) chunk.highest = find_highest(chunk.key);
        return chunk.highest;
    }

    /// Records a touch: keeps the earliest time index and the latest end, seconds.
    void touch(Slot slot, TimeIndex time_index, double end) {
        Chunk& chunk = chunks_[slot];
        if (chunk.time_index == kNever) {
            touched_.push_back(slot);
            chunk.time_index = time_index;
            chunk.end = end;
            return;
        }
        chunk.time_index = std::min(chunk.time_index, time_index);
        chunk.end = std::max(chunk.end, end);
    }

    /// Propagates touches to ancestors. Call it after the last touch().
    void touch_ancestors();

    const ChunkKey& key(Slot slot) const { return chunks_[slot].key; }
    /// First touch of a chunk; kNever where it is not touched or not in the table.
    TimeIndex time_index(const ChunkKey& key) const;
    /// Last touch, seconds. Requires a touched chunk.
    double end(const ChunkKey& key) const { return chunks_[index_[bucket_of(key)].slot].end; }

    /// The touched chunks, ordered by time index, level and key.
    ///
    /// @param time_count above every time index in use
    /// @param slots_out    resized
    void sort(std::size_t time_count, std::vector<Slot>& slots_out);
    TimeIndex time_index(Slot slot) const { return chunks_[slot].time_index; }

private:
    static constexpr Slot kNone = std::numeric_limits<Slot>::max();
    static constexpr double kUnknown = std::numeric_limits<double>::infinity();
    struct Chunk {
        ChunkKey key;
        TimeIndex time_index = kNever;
        double end = 0.0;  // if touched
        Slot parent = kNone;
        std::uint32_t last_used_round = 0;  // of slot()
        double highest = kUnknown;
    };

    struct HashEntry {
        ChunkKey key;
        Slot slot = kNone;
    };

    // Position in the index of a key, or of the free entry for it.
    std::size_t bucket_of(const ChunkKey& key) const {
        const std::size_t mask = index_.size() - 1;
        std::size_t at = ChunkKeyHash{}(key)&mask;
        while (index_[at].slot != kNone && index_[at].key != key) at = (at + 1) & mask;
        return at;
    }
    Slot add(const ChunkKey& key);
    double find_highest(const ChunkKey& key) const;
    void order_added();
    void drop_unused();

    const HeightSource& source_;
    std::uint8_t level_;
    std::vector<Chunk> chunks_;
    std::vector<HashEntry> index_;  // open addressing; its size is a power of two
    std::vector<Slot> touched_;     // unordered
    std::vector<Slot> order_;       // of all chunks: level, key
    std::vector<Slot> added_;       // not in order_ yet
    std::vector<std::size_t> counts_;
    std::vector<Chunk> kept_;
    std::uint32_t round_ = 1;      // counts clear()
    std::size_t most_chunks_ = 0;  // above it clear() drops unused ones
};

}  // namespace terrane::internal
