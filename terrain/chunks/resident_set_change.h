// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Converts an index that is not negative.
inline std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// A block of slots that own chunks; free slots are null. A set copies the blocks that change and shares the others
/// with the set before: updating the reference count of every chunk for every set would dominate the cost, because
/// the counts are scattered in memory.
struct ResidentSet::Owners {
    static constexpr std::size_t kSlots = 32;
    std::array<std::shared_ptr<const Chunk>, kSlots> slots;

    static std::size_t block(std::int32_t slot) { return static_cast<std::size_t>(slot) / kSlots; }
    static std::size_t index_in_block(std::int32_t slot) {
        return static_cast<std::size_t>(slot) % kSlots;
    }
};

/// Derives a structure from an older one.
class ResidentSet::Change {
public:
    Change(const Structure& before, const Lattice& window);
    std::shared_ptr<const Structure> make(std::span<const ChunkKey> evicted,
                                          std::vector<std::shared_ptr<const Chunk>> arrived);

private:
    void remove(const ChunkKey& key);
    void merge(std::vector<std::shared_ptr<const Chunk>> arrived);
    void keep(std::size_t first, std::size_t end);
    void add(std::shared_ptr<const Chunk> chunk);
    void fill_table();
    void list_solids();
    void link_neighbours();
    void link_parents();

    std::shared_ptr<const Chunk>& owner(std::int32_t slot);
    std::int32_t take_slot();
    std::int32_t next_index() const { return static_cast<std::int32_t>(made_->keys.size()); }

    static constexpr std::int32_t kEvicted = kNone - 1;

    const Structure& before_;
    std::shared_ptr<Structure> made_;
    std::vector<Owners*> own_blocks_;  // of made_->owners: the unshared ones, else null
    std::vector<std::int32_t>
        new_indices_;  // [old index + 1]: new index, kNone or kEvicted; kNone maps to kNone
    std::vector<std::int32_t> arrived_;  // their indices
};

// Position of a key in the table, or of the free entry for it. Multiplicative (Fibonacci) hashing: keys lie in rows and
// squares, which it spreads over the upper bits more evenly than a random hash.
inline std::size_t ResidentSet::Structure::bucket_of(const ChunkKey& key) const {
    const std::uint64_t packed =
        static_cast<std::uint32_t>(key.x) | std::uint64_t{static_cast<std::uint32_t>(key.y)} << 32;
    const std::uint64_t hash = (packed + key.level * 0xd1b54a32d192ed03u) * 0x9e3779b97f4a7c15u;
    const std::size_t mask = table.size() - 1;
    std::size_t place = hash >> table_shift;
    while (table[place] != kNone && keys[static_cast<std::size_t>(table[place])] != key)
        place = (place + 1) & mask;
    return place;
}

}  // namespace terrane
