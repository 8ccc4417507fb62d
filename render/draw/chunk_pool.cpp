// SPDX-License-Identifier: MIT
#include "draw/chunk_pool.h"

#include <algorithm>

namespace terrane::internal {
namespace {

constexpr GLsizeiptr kHeightBytes = GLsizeiptr{sizeof(std::int32_t)} * kSlotSamples;
constexpr int kFirstPageSlots = 32;      // 2.1 MB
constexpr int kLargestPageSlots = 1024;  // 68 MB
// Padding after the last slot: an invalid 16-bit index still reads inside the buffer.
constexpr GLsizeiptr kSpareBytes = GLsizeiptr{sizeof(std::int32_t)} * (65536 - kSlotSamples);

bool is_same(const std::weak_ptr<const Chunk>& chunk, const std::shared_ptr<const Chunk>& now) {
    return !chunk.owner_before(now) && !now.owner_before(chunk);
}

ChunkPage make_page(int capacity) {
    ChunkPage page;
    page.capacity = capacity;
    page.heights = make_buffer();
    glNamedBufferStorage(page.heights.name(), capacity * kHeightBytes + kSpareBytes, nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    for (int slot = capacity; slot-- > 0;) page.free.push_back(slot);
    return page;
}

// A copy of a full page with additional slots.
ChunkPage grow(const ChunkPage& old, int capacity) {
    ChunkPage page = make_page(capacity);
    glCopyNamedBufferSubData(old.heights.name(), page.heights.name(), 0, 0,
                             old.capacity * kHeightBytes);
    page.free.resize(static_cast<std::size_t>(capacity - old.capacity));
    return page;
}

}  // namespace

int ChunkPool::largest_page() {
    GLint block_bytes = 0;
    glGetIntegerv(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block_bytes);
    // offsets of all chunks of a page must fit into one storage block
    const auto blocks = static_cast<int>(block_bytes / kHeightBytes);
    return std::clamp(blocks, 1, kLargestPageSlots);
}

void ChunkPool::follow(const ResidentSet& resident) {
    ++follow_count_;
    for (auto entry = slots_.begin(); entry != slots_.end();) {
        const std::int32_t index = resident.find(entry->first);
        if (index != ResidentSet::kNone &&
            is_same(entry->second.chunk, resident.chunks()[static_cast<std::size_t>(index)])) {
            ++entry;
            continue;
        }
        pages_[static_cast<std::size_t>(entry->second.page)].free.push_back(entry->second.slot);
        entry = slots_.erase(entry);
    }
    while (!pages_.empty() &&
           pages_.back().free.size() == static_cast<std::size_t>(pages_.back().capacity)) {
        pages_.pop_back();
    }
}

const ChunkSlot* ChunkPool::find(const ResidentSet& resident, const Chunk& chunk) {
    const auto entry = slots_.find(chunk.key);
    if (entry != slots_.end() && entry->second.checked == follow_count_ &&
        entry->second.chunk.lock().get() == &chunk) {
        return &entry->second;
    }
    const std::int32_t index = resident.find(chunk.key);
    if (index == ResidentSet::kNone) return nullptr;
    const std::shared_ptr<const Chunk>& owner = resident.chunks()[static_cast<std::size_t>(index)];
    if (owner.get() != &chunk) return nullptr;

    ChunkSlot& slot = slots_[chunk.key];
    const bool is_new = slot.page < 0 || !is_same(slot.chunk, owner);
    if (slot.page < 0) take_slot(slot);
    if (is_new) {
        slot.chunk = owner;
        upload_heights(slot, chunk);
    }
    slot.checked = follow_count_;
    return &slot;
}

// Takes a free slot of the first page that has one, else grows the last page, else adds a page.
void ChunkPool::take_slot(ChunkSlot& slot) {
    auto page = std::find_if(pages_.begin(), pages_.end(),
                             [](const ChunkPage& p) { return !p.free.empty(); });
    if (page == pages_.end()) {
        if (!pages_.empty() && pages_.back().capacity < max_page_slots_) {
            pages_.back() =
                grow(pages_.back(), std::min(2 * pages_.back().capacity, max_page_slots_));
        } else {
            pages_.push_back(make_page(std::min(kFirstPageSlots, max_page_slots_)));
        }
        page = std::prev(pages_.end());
    }
    slot.page = static_cast<int>(page - pages_.begin());
    slot.slot = page->free.back();
    page->free.pop_back();
}

void ChunkPool::upload_heights(const ChunkSlot& slot, const Chunk& chunk) const {
    glNamedBufferSubData(page(slot.page).heights.name(), slot.slot * kHeightBytes, kHeightBytes,
                         chunk.heights.data());
}

std::size_t ChunkPool::bytes() const {
    return slots_.size() * static_cast<std::size_t>(kHeightBytes);
}

}  // namespace terrane::internal
