// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>

namespace terrane {

/// Names one square chunk: level 0 is a root square, the coarsest; a chunk of level n + 1 has half
/// the side. x grows east, y grows north; (0, 0) has its south-west corner at lattice point (0, 0).
struct ChunkKey {
    std::int32_t x = 0;      ///< column, counted in chunks of the level from lattice point (0, 0)
    std::int32_t y = 0;      ///< row
    std::uint8_t level = 0;  ///< 0: a root square

    friend constexpr auto operator<=>(const ChunkKey&, const ChunkKey&) = default;

    /// The chunk of the next coarser level that covers this one. Rounds down, also below zero.
    /// Requires level > 0.
    constexpr ChunkKey parent() const {
        return {x >> 1, y >> 1, static_cast<std::uint8_t>(level - 1)};
    }

    /// One of the four chunks of the next finer level: quadrant bit 0 is east, bit 1 is north.
    constexpr ChunkKey child(int quadrant) const {
        return {2 * x + (quadrant & 1), 2 * y + (quadrant >> 1),
                static_cast<std::uint8_t>(level + 1)};
    }

    /// Which child of its parent this is. Requires level > 0.
    constexpr int quadrant() const { return (x & 1) | ((y & 1) << 1); }
};

/// For unordered containers that are looked up, never iterated.
struct ChunkKeyHash {
    /// Hash of all members.
    std::size_t operator()(const ChunkKey& key) const {
        const std::uint64_t packed = static_cast<std::uint32_t>(key.x) |
                                     std::uint64_t{static_cast<std::uint32_t>(key.y)} << 32;
        const std::uint64_t hash = (packed + key.level * 0xd1b54a32d192ed03u) * 0x9e3779b97f4a7c15u;
        return static_cast<std::size_t>(hash >> 32);
    }
};

}  // namespace terrane
