// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace terrane {

/// Lowest and highest of some samples, quanta.
struct SampleRange {
    std::int32_t low = 0;   ///< lowest sample
    std::int32_t high = 0;  ///< highest sample
    friend constexpr bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// The ranges of a chunk's samples over squares of 4, 8, ... 128 cells along the side, edges included.
/// Squares are aligned to their size.
class SamplePyramid {
public:
    /// log2 of the cells along the side of the smallest and of the largest squares.
    static constexpr int kFinest = 2;
    static constexpr int kCoarsest = 7;  ///< of the largest
    static_assert(1 << kCoarsest == kChunkCells);

    /// Computes the ranges of a chunk's samples.
    ///
    /// @param heights [kChunkSamples^2] as Chunk::heights
    void fill(std::span<const std::int32_t> heights);

    /// The range of the square that contains a cell.
    ///
    /// @param log2_side   kFinest to kCoarsest
    /// @param column, row of the cell in its chunk, 0 to kChunkCells - 1
    const SampleRange& at(int log2_side, int column, int row) const {
        return ranges_[index(log2_side, column, row)];
    }

private:
    static constexpr std::size_t index(int log2_side, int column, int row) {
        // number of smaller squares: a geometric series
        const int first = ((1 << 12) - (1 << (16 - 2 * log2_side))) / 3;
        return static_cast<std::size_t>(first + ((row >> log2_side) << (kCoarsest - log2_side)) +
                                        (column >> log2_side));
    }
    std::array<SampleRange, 1365> ranges_{};  // fine to coarse; row by row from the south-west
};

}  // namespace terrane
