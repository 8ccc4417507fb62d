// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A hash table from squares of a quadtree to numbers, with linear probing, for a buffer texture of ivec4:
/// find_entry() of light.glsl reads it.
class SquareTable {
public:
    struct Entry {
        std::int32_t x = 0, y = 0;  ///< in squares of the level, relative to the square of the eye
        std::int32_t level = -1;    ///< -1: free
        std::int32_t value = 0;
    };

    /// @param count entries that will be added at most; at least half of the places stay free
    explicit SquareTable(std::size_t count);

    /// Adds a square that is not in the table.
    ///
    /// @param x, y relative to the square of the eye; clamped to 2^30: squares that far are below the precision of
    ///           float
    void add(std::int64_t x, std::int64_t y, int level, std::int32_t value);

    std::span<const Entry> entries() const { return entries_; }
    /// Number of places minus 1.
    std::int32_t mask() const { return static_cast<std::int32_t>(entries_.size()) - 1; }

private:
    std::vector<Entry> entries_;
};
static_assert(sizeof(SquareTable::Entry) == 16);

}  // namespace terrane::internal
