// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Converts a non-negative index.
inline std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// A block of slots that own chunks; free slots are null. A new set copies the blocks that change and shares the others
/// with the previous set. Without blocks it would change the reference counts of all chunks; these are scattered in
/// memory and would dominate the cost of a new set.
struct ResidentSet::Owners {
    static constexpr std::size_t kSlots = 32;
    std::array<std::shared_ptr<const Chunk>, kSlots> slots;

    static std::size_t block(std::int32_t slot) { return static_cast<std::size_t>(slot) / kSlots; }
    static std::size_t index_in_block(std::int32_t slot) {
        return static_cast<std::size_t>(slot) % kSlots;
    }
};

/// The undrawn chunks of a set: a hash table in pages. A new set copies the pages that change and shares the others
/// with the previous set.
class ResidentSet::Undrawn {
public:
    /// @param before null: none
    /// @return null if no chunks remain
    static std::shared_ptr<const Undrawn> make(const Undrawn* before,
                                               std::span<const ChunkKey> removed,
                                               std::span<const UndrawnChunk> added);

    const UndrawnChunk* find(const ChunkKey& key) const {
        const std::uint64_t hash = hash_of(key);
        const Page& page = *pages_[hash >> shift_];
        for (std::size_t slot = first_slot(hash);; slot = (slot + 1) % kSlots) {
            const UndrawnChunk& found = page.slots[slot];
            if (is_free(found)) return nullptr;
            if (found.key == key) return &found;
        }
    }
    std::size_t count() const { return count_; }
    bool has_solids() const { return solid_count_ > 0; }

private:
    // Linear probing. A page always has a free slot; with the mean number of chunks it is far from full.
    static constexpr int kSlotsLog2 = 5;
    static constexpr std::size_t kSlots = std::size_t{1} << kSlotsLog2;
    static constexpr std::size_t kMostMean = 10;
    struct Page {
        std::array<UndrawnChunk, kSlots> slots;
        std::size_t count = 0;
    };

    static bool is_free(const UndrawnChunk& slot) {
        return slot.chunk == nullptr && slot.outline == nullptr;
    }
    static std::uint64_t hash_of(const ChunkKey& key) {
        const std::uint64_t packed = static_cast<std::uint32_t>(key.x) |
                                     std::uint64_t{static_cast<std::uint32_t>(key.y)} << 32;
        return (packed + key.level * 0xd1b54a32d192ed03u) * 0x9e3779b97f4a7c15u;
    }
    std::size_t first_slot(std::uint64_t hash) const {
        return (hash >> (shift_ - kSlotsLog2)) % kSlots;
    }

    void grow();
    Page& own_page(std::size_t index);
    bool add(const UndrawnChunk& chunk);
    void remove(const ChunkKey& key);

    std::vector<std::shared_ptr<const Page>> pages_;  // 2^(64 - shift_), at least two
    std::vector<Page*> own_pages_;                    // [pages_] null: shared with an older set
    int shift_ = 63;
    std::size_t count_ = 0;
    std::size_t solid_count_ = 0;
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
    std::int32_t allocate_slot();
    std::int32_t next_index() const { return static_cast<std::int32_t>(made_->keys.size()); }

    static constexpr std::int32_t kEvicted = kNone - 1;

    const Structure& before_;
    std::shared_ptr<Structure> made_;
    std::vector<Owners*> own_blocks_;  // [made_->owners] the block, or null if it is shared
    std::vector<std::int32_t>
        new_indices_;  // [old index + 1] new index, kNone or kEvicted; kNone maps to kNone
    std::vector<std::int32_t> arrived_;  // indices of the arrived chunks
};

// Index of a key's entry in the table, or of the free entry for it. Multiplicative (Fibonacci) hashing distributes
// keys, which form rows and squares, over the upper bits more evenly than a random hash.
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

namespace terrane::internal {

/// Index of the window's first root square along one axis: the index nearest to `before` for which the root square at
/// `place` is one of the window's middle two, clamped so that the window lies in the world.
///
/// @param first, count first root square of the world, and number of its root squares
/// @param along        number of root squares of the window
/// @param before       first root square of the previous window
inline std::int32_t first_in_window(double place, double origin, double side, std::int32_t first,
                                    std::int32_t count, std::int32_t along, std::int64_t before) {
    const std::int64_t last = std::int64_t{first} + count - 1;
    const double index = std::clamp(std::floor((place - origin) / side), static_cast<double>(first),
                                    static_cast<double>(last));
    const std::int64_t least = static_cast<std::int64_t>(index) - along / 2;
    const std::int64_t wanted = std::clamp(before, least, least + 1);
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(wanted, first, std::max<std::int64_t>(first, last + 1 - along)));
}

/// The root window of a world for a client at a position, as a lattice of the window's root squares
/// (ResidentSet::window()). It is the previous window, moved as little as possible so that the client's root square is
/// one of the middle two along each axis. A client that repeatedly crosses the edge between two root squares therefore
/// moves the window only once. Returns the lattice of the world if it has no root window.
///
/// @param place finite, metres
inline Lattice moved_root_window(const Lattice& world, const Lattice& before,
                                 const WorldVec2& place) {
    Lattice window = world;
    window.root_window = 0;
    if (world.root_window == 0) return window;
    const double side = world.root_size();
    window.root_count_x = std::min(world.root_count_x, world.root_window);
    window.root_count_y = std::min(world.root_count_y, world.root_window);
    window.first_root_x =
        first_in_window(place.x(), world.origin_x, side, world.first_root_x, world.root_count_x,
                        window.root_count_x, before.first_root_x);
    window.first_root_y =
        first_in_window(place.y(), world.origin_y, side, world.first_root_y, world.root_count_y,
                        window.root_count_y, before.first_root_y);
    return window;
}

/// The window of a pager without clients: centred on the lattice's origin.
inline Lattice first_root_window(const Lattice& world) {
    return moved_root_window(world, world, {world.origin_x, world.origin_y});
}

/// The rectangle of a lattice's root squares, metres.
inline WorldRect rect_of_roots(const Lattice& lattice) {
    return {lattice.x(lattice.west()), lattice.y(lattice.south()), lattice.x(lattice.east()),
            lattice.y(lattice.north())};
}

/// Whether all ground of a region is inside a window.
inline bool is_in_window(const WorldRect& region, const WorldRect& extent, const Lattice& window) {
    const WorldRect roots = rect_of_roots(window);
    return std::max(region.west, extent.west) >= roots.west &&
           std::max(region.south, extent.south) >= roots.south &&
           std::min(region.east, extent.east) <= roots.east &&
           std::min(region.north, extent.north) <= roots.north;
}

}  // namespace terrane::internal
