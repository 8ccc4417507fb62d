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

/// Chunks of one level and their ancestors, which moment touches each first, and when each is touched
/// last. Moments are numbers: a smaller one is earlier.
///
/// What it knows of a chunk beyond that, its heights and its place in the order, it keeps from one
/// clear() to the next, as long as it is of use. That never changes an answer.
///
/// Allocates: while it grows
class TouchTable {
public:
    using Slot = std::uint32_t;
    using Moment = std::uint32_t;
    static constexpr Moment kNever = std::numeric_limits<Moment>::max();

    /// The source outlives it.
    TouchTable(const HeightSource& source, int level);

    /// Nothing is touched any more. Slots are void.
    void clear();

    /// The slot of a chunk of the level. Requires a chunk of the world.
    Slot slot(std::int32_t x, std::int32_t y) {
        const ChunkKey key{x, y, level_};
        Slot slot = index_[place(key)].slot;
        if (slot == kNone) slot = add(key);
        chunks_[slot].asked_in = round_;
        return slot;
    }

    /// The highest ground of a chunk, metres: no sample of it is higher.
    double highest(Slot slot) {
        Chunk& chunk = chunks_[slot];
        if (chunk.highest == kUnknown) chunk.highest = find_highest(chunk.key);
        return chunk.highest;
    }

    /// Keeps the earliest moment and the latest end, seconds.
    void touch(Slot slot, Moment moment, double end) {
        Chunk& chunk = chunks_[slot];
        if (chunk.moment == kNever) {
            touched_.push_back(slot);
            chunk.moment = moment;
            chunk.end = end;
            return;
        }
        chunk.moment = std::min(chunk.moment, moment);
        chunk.end = std::max(chunk.end, end);
    }

    /// Touches ancestors when what is below them is touched. Call it after the last touch().
    void touch_ancestors();

    const ChunkKey& key(Slot slot) const { return chunks_[slot].key; }
    /// kNever too for a chunk that it does not know.
    Moment moment(const ChunkKey& key) const;
    /// Of a chunk that is touched.
    double end(const ChunkKey& key) const { return chunks_[index_[place(key)].slot].end; }

    /// What is touched, ordered by moment, level and key.
    ///
    /// @param moment_count moments that were used are below it
    /// @param slots_out    resized
    void sort(std::size_t moment_count, std::vector<Slot>& slots_out);
    Moment moment(Slot slot) const { return chunks_[slot].moment; }

private:
    static constexpr Slot kNone = std::numeric_limits<Slot>::max();
    static constexpr double kUnknown = std::numeric_limits<double>::infinity();
    struct Chunk {
        ChunkKey key;
        Moment moment = kNever;
        double end = 0.0;  // where it is touched
        Slot parent = kNone;
        std::uint32_t asked_in = 0;  // the last round with a slot() of it
        double highest = kUnknown;
    };

    struct Place {
        ChunkKey key;
        Slot slot = kNone;
    };

    // Where a key stands in the index, or would stand.
    std::size_t place(const ChunkKey& key) const {
        const std::size_t mask = index_.size() - 1;
        std::size_t at = ChunkKeyHash{}(key)&mask;
        while (index_[at].slot != kNone && index_[at].key != key) at = (at + 1) & mask;
        return at;
    }
    Slot add(const ChunkKey& key);
    double find_highest(const ChunkKey& key) const;
    void order_added();
    void forget_unused();

    const HeightSource& source_;
    std::uint8_t level_;
    std::vector<Chunk> chunks_;
    std::vector<Place> index_;   // open addressing; its size is a power of two
    std::vector<Slot> touched_;  // in no order
    std::vector<Slot> order_;    // of all chunks: level, key
    std::vector<Slot> added_;    // not in order_ yet
    std::vector<std::size_t> counts_;
    std::vector<Chunk> kept_;
    std::uint32_t round_ = 1;      // from clear() to clear()
    std::size_t most_chunks_ = 0;  // before it tidies up
};

}  // namespace terrane::internal
