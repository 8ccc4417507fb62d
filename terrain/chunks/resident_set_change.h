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

/// An index into the vectors of a set that is not negative.
inline std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// A block of slots; an empty one holds null. A set copies the blocks in which something changed and
/// shares the others with the set before: counting every owner up for each new set, and down for each
/// old one, would take longer than all the rest, since the counts lie all over the memory.
struct ResidentSet::Owners {
    static constexpr std::size_t kSlots = 32;
    std::array<std::shared_ptr<const Chunk>, kSlots> slots;

    static std::size_t block(std::int32_t slot) { return static_cast<std::size_t>(slot) / kSlots; }
    static std::size_t place(std::int32_t slot) { return static_cast<std::size_t>(slot) % kSlots; }
};

/// Makes a structure of an older one.
class ResidentSet::Change {
public:
    explicit Change(const Structure& before);
    std::shared_ptr<const Structure> make(std::span<const ChunkKey> gone,
                                          std::vector<std::shared_ptr<const Chunk>> come);

private:
    void remove(const ChunkKey& key);
    void merge(std::vector<std::shared_ptr<const Chunk>> come);
    void keep(std::size_t first, std::size_t end);
    void add(std::shared_ptr<const Chunk> chunk);
    void fill_table();
    void link_neighbours();
    void link_parents();

    std::shared_ptr<const Chunk>& owner(std::int32_t slot);
    std::int32_t take_slot();
    std::int32_t next_index() const { return static_cast<std::int32_t>(made_->keys.size()); }

    static constexpr std::int32_t kGone = kNone - 1;

    const Structure& before_;
    std::shared_ptr<Structure> made_;
    std::vector<Owners*> own_blocks_;  // those of made_->owners that are not shared, else null
    std::vector<std::int32_t> moved_;  // by index before + 1: the index now, or kNone, as kNone is
    std::vector<std::int32_t> arrived_;  // indices of what came
};

// Where a key stands in the table, or would. Keys lie in rows and squares: multiples of an odd number
// spread these over the upper bits more evenly than chance would.
inline std::size_t ResidentSet::Structure::place(const ChunkKey& key) const {
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
