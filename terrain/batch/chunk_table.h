// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// What a height needs of a chunk, in one cache line.
struct ChunkEntry {
    std::int64_t column = 0, row = 0;  ///< of the chunk on its level
    std::uint64_t call = 0;            ///< that wrote the entry
    /// Null where points of the chunk are answered one by one: it is absent, or has volumes.
    const std::int32_t* heights = nullptr;
    const float* cell_bounds = nullptr;
    const std::uint8_t* cell_flags = nullptr;  ///< null: all cells are ground
};

/// The chunks that one thread has found in one call, by the low bits of their columns and rows. A chunk replaces
/// another one in its place.
class ChunkTable {
public:
    ChunkTable() : entries_(kSide * kSide) {}

    /// The entry of a chunk's place; it may be another chunk's.
    ChunkEntry& at(std::int64_t column, std::int64_t row) {
        return entries_[static_cast<std::size_t>(((row & (kSide - 1)) * kSide) +
                                                 (column & (kSide - 1)))];
    }

private:
    static constexpr std::int64_t kSide = 32;
    std::vector<ChunkEntry> entries_;
};

}  // namespace terrane::internal
