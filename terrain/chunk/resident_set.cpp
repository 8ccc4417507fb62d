// SPDX-License-Identifier: MIT
#include "chunk/resident_set.h"

#include <terrane/base/result.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

namespace terrane {
namespace {

[[maybe_unused]] bool are_fades(std::span<const float> fades) {
    return std::all_of(fades.begin(), fades.end(),
                       [](float fade) { return fade >= 0.0f && fade <= 1.0f; });
}

}  // namespace

std::shared_ptr<const ResidentSet::Structure> ResidentSet::make_structure(
    const Lattice& lattice, const WorldRect& extent,
    std::vector<std::shared_ptr<const Chunk>> chunks) {
    Structure none;
    none.lattice = lattice;
    none.extent = extent;
    return Change(none, internal::first_root_window(lattice)).make({}, std::move(chunks));
}

ResidentSet::ResidentSet(const Lattice& lattice, const WorldRect& extent,
                         std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch)
    : structure_(make_structure(lattice, extent, std::move(chunks))), epoch_(epoch) {
    fades_.assign(structure_->chunks.size(), 1.0f);
}

ResidentSet::ResidentSet(const Lattice& lattice, const WorldRect& extent,
                         std::vector<std::shared_ptr<const Chunk>> chunks,
                         std::span<const float> fades, std::uint64_t epoch)
    : structure_(make_structure(lattice, extent, chunks)), epoch_(epoch) {
    TERRANE_ASSERT(fades.size() == chunks.size() && are_fades(fades),
                   "each chunk needs a fade of 0 to 1");
    fades_.resize(fades.size());
    for (std::size_t i = 0; i < fades.size(); ++i) fades_[at(find(chunks[i]->key))] = fades[i];
}

ResidentSet::ResidentSet(const ResidentSet& before, std::span<const ChunkKey> evicted,
                         std::vector<std::shared_ptr<const Chunk>> arrived,
                         std::vector<float> fades, std::uint64_t epoch, const Lattice& window)
    : structure_(Change(*before.structure_, window).make(evicted, std::move(arrived))),
      undrawn_(before.undrawn_),
      fades_(std::move(fades)),
      epoch_(epoch) {
    TERRANE_ASSERT(fades_.size() == structure_->chunks.size() && are_fades(fades_),
                   "each chunk needs a fade of 0 to 1");
}

ResidentSet::ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch)
    : structure_(same.structure_),
      undrawn_(same.undrawn_),
      fades_(std::move(fades)),
      epoch_(epoch) {
    TERRANE_ASSERT(fades_.size() == structure_->chunks.size() && are_fades(fades_),
                   "each chunk needs a fade of 0 to 1");
}

ResidentSet::ResidentSet(const ResidentSet& same, std::span<const ChunkKey> removed,
                         std::span<const UndrawnChunk> added, std::uint64_t epoch)
    : structure_(same.structure_),
      undrawn_(Undrawn::make(same.undrawn_.get(), removed, added)),
      fades_(same.fades_),
      epoch_(epoch) {}

std::int32_t ResidentSet::Structure::find(const ChunkKey& key) const {
    return table[bucket_of(key)];
}

std::int32_t ResidentSet::find(const ChunkKey& key) const { return structure_->find(key); }

const Chunk* ResidentSet::find_chunk(ChunkKey key) const {
    const Structure& structure = *structure_;
    const std::int32_t found = structure.table[structure.bucket_of(key)];
    return found == kNone ? nullptr : structure.chunks[at(found)].get();
}

const UndrawnChunk* ResidentSet::find_undrawn(ChunkKey key) const {
    return undrawn_ == nullptr ? nullptr : undrawn_->find(key);
}

const Chunk* ResidentSet::find_ground(ChunkKey key) const {
    if (const Chunk* const drawn = find_chunk(key)) return drawn;
    const UndrawnChunk* const undrawn = find_undrawn(key);
    return undrawn == nullptr ? nullptr : undrawn->chunk.get();
}

std::shared_ptr<const Chunk> ResidentSet::share_ground(ChunkKey key) const {
    if (const std::int32_t index = find(key); index != kNone) return structure_->chunks[at(index)];
    const UndrawnChunk* const undrawn = find_undrawn(key);
    return undrawn == nullptr ? nullptr : undrawn->chunk;
}

std::size_t ResidentSet::undrawn_count() const {
    return undrawn_ == nullptr ? 0 : undrawn_->count();
}

bool ResidentSet::has_solids() const {
    return !structure_->solids.empty() || (undrawn_ != nullptr && undrawn_->has_solids());
}

std::shared_ptr<const ResidentSet::Undrawn> ResidentSet::Undrawn::make(
    const Undrawn* before, std::span<const ChunkKey> removed, std::span<const UndrawnChunk> added) {
    auto made = std::make_shared<Undrawn>();
    if (before == nullptr) {
        const auto empty = std::make_shared<const Page>();
        made->pages_.assign(2, empty);
    } else {
        *made = *before;
    }
    made->own_pages_.assign(made->pages_.size(), nullptr);
    for (const ChunkKey& key : removed) made->remove(key);
    for (const UndrawnChunk& chunk : added) {
        while (!made->add(chunk)) made->grow();
    }
    made->own_pages_ = {};
    return made->count_ == 0 ? nullptr : made;
}

// Twice as many pages.
void ResidentSet::Undrawn::grow() {
    const std::vector<std::shared_ptr<const Page>> old = std::exchange(pages_, {});
    const auto empty = std::make_shared<const Page>();
    pages_.assign(2 * old.size(), empty);
    own_pages_.assign(pages_.size(), nullptr);
    --shift_;
    count_ = solid_count_ = 0;
    for (const auto& page : old) {
        for (const UndrawnChunk& chunk : page->slots) {
            if (is_free(chunk)) continue;
            while (!add(chunk)) grow();
        }
    }
}

ResidentSet::Undrawn::Page& ResidentSet::Undrawn::own_page(std::size_t index) {
    if (own_pages_[index] == nullptr) {
        auto copy = std::make_shared<Page>(*pages_[index]);
        own_pages_[index] = copy.get();
        pages_[index] = std::move(copy);
    }
    return *own_pages_[index];
}

// Adds or replaces a chunk. Returns false if there must be more pages first.
bool ResidentSet::Undrawn::add(const UndrawnChunk& chunk) {
    TERRANE_ASSERT(!is_free(chunk), "an undrawn chunk is a chunk or its outline");
    remove(chunk.key);
    const std::uint64_t hash = hash_of(chunk.key);
    const std::size_t index = hash >> shift_;
    if (count_ >= kMostMean * pages_.size() || pages_[index]->count + 1 == kSlots) return false;
    Page& page = own_page(index);
    std::size_t slot = first_slot(hash);
    while (!is_free(page.slots[slot])) slot = (slot + 1) % kSlots;
    page.slots[slot] = chunk;
    ++page.count;
    ++count_;
    solid_count_ += chunk.chunk != nullptr && chunk.chunk->solid != nullptr ? 1u : 0u;
    return true;
}

// Does nothing for a chunk that is not there.
void ResidentSet::Undrawn::remove(const ChunkKey& key) {
    const UndrawnChunk* const found = find(key);
    if (found == nullptr) return;
    solid_count_ -= found->chunk != nullptr && found->chunk->solid != nullptr ? 1u : 0u;
    --count_;
    const std::size_t index = hash_of(key) >> shift_;
    auto at = static_cast<std::size_t>(found - pages_[index]->slots.data());
    Page& page = own_page(index);
    page.slots[at] = {};
    --page.count;
    // moves back the chunks that were placed beyond their first slot
    for (std::size_t next = (at + 1) % kSlots; !is_free(page.slots[next]);
         next = (next + 1) % kSlots) {
        const std::size_t wanted = first_slot(hash_of(page.slots[next].key));
        if ((next - wanted) % kSlots < (next - at) % kSlots) continue;
        page.slots[at] = std::exchange(page.slots[next], {});
        at = next;
    }
}

namespace {

std::ptrdiff_t offset(std::size_t index) { return static_cast<std::ptrdiff_t>(index); }

}  // namespace

ResidentSet::Change::Change(const Structure& before, const Lattice& window)
    : before_(before),
      made_(std::make_shared<Structure>()),
      own_blocks_(before.owners.size(), nullptr),
      new_indices_(before.keys.size() + 1, kNone) {
    made_->lattice = before.lattice;
    made_->window = window;
    made_->extent = before.extent;
    made_->owners = before.owners;
    made_->free_slots = before.free_slots;
}

std::shared_ptr<const ResidentSet::Structure> ResidentSet::Change::make(
    std::span<const ChunkKey> evicted, std::vector<std::shared_ptr<const Chunk>> arrived) {
    for (const ChunkKey& key : evicted) remove(key);
    merge(std::move(arrived));
    fill_table();
    list_solids();
    link_neighbours();
    link_parents();
    TERRANE_ASSERT(
        made_->slots.size() + made_->free_slots.size() == made_->owners.size() * Owners::kSlots,
        "every slot is taken or free");
    return made_;
}

void ResidentSet::Change::remove(const ChunkKey& key) {
    const std::int32_t index = before_.find(key);
    TERRANE_ASSERT(index != kNone && new_indices_[at(index + 1)] != kEvicted,
                   "an evicted chunk must be resident, and evicted once");
    new_indices_[at(index + 1)] = kEvicted;
    made_->free_slots.push_back(before_.slots[at(index)]);
    owner(made_->free_slots.back()).reset();
}

void ResidentSet::Change::merge(std::vector<std::shared_ptr<const Chunk>> arrived) {
    std::sort(arrived.begin(), arrived.end(),
              [](const auto& a, const auto& b) { return Order()(a->key, b->key); });
    const std::size_t most = before_.keys.size() + arrived.size();
    made_->keys.reserve(most);
    made_->links.reserve(most);
    made_->slots.reserve(most);
    auto next = arrived.begin();
    const auto comes_before = [&](std::size_t i) {
        return next != arrived.end() && Order()((*next)->key, before_.keys[i]);
    };
    for (std::size_t i = 0; i < before_.keys.size();) {
        if (new_indices_[i + 1] == kEvicted) {
            new_indices_[++i] = kNone;
            continue;
        }
        for (; comes_before(i); ++next) add(std::move(*next));
        const std::size_t first = i++;
        while (i < before_.keys.size() && new_indices_[i + 1] != kEvicted && !comes_before(i)) ++i;
        keep(first, i);
    }
    for (; next != arrived.end(); ++next) add(std::move(*next));

    made_->chunks.reserve(made_->slots.size());
    for (const std::int32_t slot : made_->slots) {
        const Owners& block = *made_->owners[Owners::block(slot)];
        made_->chunks.emplace_back(block.slots[Owners::index_in_block(slot)]);
    }
}

void ResidentSet::Change::keep(std::size_t first, std::size_t end) {
    std::iota(new_indices_.begin() + offset(first + 1), new_indices_.begin() + offset(end + 1),
              next_index());
    const auto append = [=](auto& to, const auto& from) {
        to.insert(to.end(), from.begin() + offset(first), from.begin() + offset(end));
    };
    append(made_->keys, before_.keys);
    append(made_->links, before_.links);
    append(made_->slots, before_.slots);
}

void ResidentSet::Change::add(std::shared_ptr<const Chunk> chunk) {
    arrived_.push_back(next_index());
    made_->keys.push_back(chunk->key);
    made_->links.emplace_back();
    made_->slots.push_back(allocate_slot());
    owner(made_->slots.back()) = std::move(chunk);
}

void ResidentSet::Change::fill_table() {
    const auto table_log2 = static_cast<int>(std::bit_width(2 * made_->keys.size() + 1));
    made_->table.assign(std::size_t{1} << table_log2, kNone);
    made_->table_shift = 64 - table_log2;
    for (std::size_t i = 0; i < made_->keys.size(); ++i) {
        std::int32_t& index = made_->table[made_->bucket_of(made_->keys[i])];
        TERRANE_ASSERT(index == kNone, "no chunk may be resident twice");
        index = static_cast<std::int32_t>(i);
    }
}

void ResidentSet::Change::list_solids() {
    for (const std::int32_t index : before_.solids) {
        const std::int32_t now = new_indices_[at(index + 1)];
        if (now != kNone) made_->solids.push_back(now);
    }
    const std::size_t kept = made_->solids.size();
    for (const std::int32_t index : arrived_) {
        if (made_->chunks[at(index)]->solid != nullptr) made_->solids.push_back(index);
    }
    std::inplace_merge(made_->solids.begin(), made_->solids.begin() + offset(kept),
                       made_->solids.end());
}

void ResidentSet::Change::link_neighbours() {
    const auto follow = [this](std::int32_t& index) { index = new_indices_[at(index + 1)]; };
    for (Links& links : made_->links) {
        follow(links.parent);
        for (std::int32_t& child : links.child) follow(child);
        for (std::int32_t& neighbour : links.neighbour) follow(neighbour);
    }
    for (const std::int32_t index : arrived_) {
        const ChunkKey& key = made_->keys[at(index)];
        const std::array<ChunkKey, 4> neighbours{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        for (std::size_t side = 0; side < 4; ++side) {
            const std::int32_t neighbour = made_->find(neighbours[side]);
            made_->links[at(index)].neighbour[side] = neighbour;
            if (neighbour == kNone) continue;
            const std::size_t opposite = side ^ 1;
            made_->links[at(neighbour)].neighbour[opposite] = index;
        }
    }
}

// Links chunks without a parent index: those that arrived, and children of a chunk that was evicted and arrived again.
void ResidentSet::Change::link_parents() {
    std::int32_t root_count = 0;
    for (std::int32_t i = 0; i < next_index(); ++i) {
        const ChunkKey& key = made_->keys[at(i)];
        if (key.level == 0) {
            ++root_count;
            continue;
        }
        Links& links = made_->links[at(i)];
        if (links.parent != kNone) continue;
        links.parent = made_->find(key.parent());
        TERRANE_ASSERT(links.parent != kNone, "the parent of a resident chunk must be resident");
        made_->links[at(links.parent)].child[static_cast<std::size_t>(key.quadrant())] = i;
    }
    made_->has_roots = std::int64_t{root_count} ==
                       std::int64_t{made_->window.root_count_x} * made_->window.root_count_y;
}

std::shared_ptr<const Chunk>& ResidentSet::Change::owner(std::int32_t slot) {
    const std::size_t block = Owners::block(slot);
    if (own_blocks_[block] == nullptr) {
        auto copy = std::make_shared<Owners>(*made_->owners[block]);
        own_blocks_[block] = copy.get();
        made_->owners[block] = std::move(copy);
    }
    return own_blocks_[block]->slots[Owners::index_in_block(slot)];
}

std::int32_t ResidentSet::Change::allocate_slot() {
    std::vector<std::int32_t>& free_slots = made_->free_slots;
    if (free_slots.empty()) {
        const std::size_t first = own_blocks_.size() * Owners::kSlots;
        for (std::size_t i = Owners::kSlots; i-- > 0;) {
            free_slots.push_back(static_cast<std::int32_t>(first + i));
        }
        auto block = std::make_shared<Owners>();
        own_blocks_.push_back(block.get());
        made_->owners.push_back(std::move(block));
    }
    const std::int32_t slot = free_slots.back();
    free_slots.pop_back();
    return slot;
}

}  // namespace terrane
