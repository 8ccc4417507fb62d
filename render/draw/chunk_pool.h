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

/// Location of a chunk on the device.
struct ChunkSlot {
    std::weak_ptr<const Chunk> chunk;  ///< distinguishes a chunk from a later one with the same key
    std::uint64_t checked = 0;  ///< number of the last follow() after which find() returned it
    int page = -1;
    int slot = -1;
};

/// A buffer of heights with one slot per chunk.
struct ChunkPage {
    GlBuffer heights;       ///< [capacity * kSlotSamples] quanta, and padding for any 16-bit index
    int capacity = 0;       ///< slots
    std::vector<int> free;  ///< free slots; the next one to use is last
};

/// Keeps the heights of drawn chunks on the device while the chunks are resident, many per buffer (page), so that one
/// draw call covers all chunks of a page.
///
/// A full page doubles up to a limit of slots; then a new page is added. Empty pages at the end are freed.
class ChunkPool {
public:
    /// @param max_page_slots 1 or more, at most largest_page()
    explicit ChunkPool(int max_page_slots) : max_page_slots_(max_page_slots) {}

    /// Slot limit of the current device, from its largest shader storage block.
    static int largest_page();

    /// Frees the slots of chunks that are not in the set. Call before find() where the set may have changed.
    void follow(const ResidentSet& resident);

    /// The slot of a chunk of the last followed set; uploads the chunk if necessary. Null where the set does not
    /// contain the chunk. The slot is valid until the next follow(), page() until the next find().
    const ChunkSlot* find(const ResidentSet& resident, const Chunk& chunk);

    int page_count() const { return static_cast<int>(pages_.size()); }
    const ChunkPage& page(int index) const { return pages_[static_cast<std::size_t>(index)]; }

    /// Bytes of the used slots.
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
