// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/terrain/resident_set.h>

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Samples of one slot of a page.
inline constexpr int kSlotSamples = kChunkSamples * kChunkSamples;

/// Where a chunk stands on the device.
struct ChunkSlot {
    std::weak_ptr<const Chunk> chunk;  ///< to tell a chunk from its successor under the same key
    std::uint64_t checked = 0;         ///< the last follow() that it was looked up after
    int page = -1;
    int slot = -1;
};

/// A buffer of heights, those of one chunk for every slot.
struct ChunkPage {
    GlBuffer heights;       ///< [capacity * kSlotSamples] quanta, and room for any 16-bit index
    int capacity = 0;       ///< slots
    std::vector<int> free;  ///< slots, the next one last
};

/// Keeps the heights of chunks that were drawn on the device for as long as they are resident, many to
/// a buffer, so that one draw call reaches all chunks of a page.
///
/// A page doubles when it is full, up to a limit of slots; then another one begins. Pages at the
/// end that hold nothing are given back.
class ChunkPool {
public:
    /// @param max_page_slots 1 or more, at most largest_page()
    explicit ChunkPool(int max_page_slots) : max_page_slots_(max_page_slots) {}

    /// What the current device takes: bytes of a buffer that a shader reads.
    static int largest_page();

    /// Forgets what is not in the set any more. Call before find() where the set may have changed.
    void follow(const ResidentSet& resident);

    /// Of a chunk of the set that was followed last; uploads it where it is not there. Null where the
    /// set does not hold the chunk.
    /// The slot stands until the next follow(), page() until the next find().
    const ChunkSlot* find(const ResidentSet& resident, const Chunk& chunk);

    int page_count() const { return static_cast<int>(pages_.size()); }
    const ChunkPage& page(int index) const { return pages_[static_cast<std::size_t>(index)]; }

    /// Of the slots that chunks stand in.
    std::size_t bytes() const;

private:
    void take_slot(ChunkSlot& slot);
    void upload_heights(const ChunkSlot& slot, const Chunk& chunk) const;

    int max_page_slots_;
    std::uint64_t follow_count_ = 0;
    std::map<ChunkKey, ChunkSlot> slots_;
    std::vector<ChunkPage> pages_;
};

}  // namespace terrane::internal
