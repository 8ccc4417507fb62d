// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>

namespace terrane {

/// log2 of kChunkCells: a right shift by it gives a cell's chunk index, rounded down also below zero.
inline constexpr int kChunkShift = SamplePyramid::kCoarsest;

/// The product with the reciprocal is inexact: corrected by comparison with the lines.
inline std::int64_t Ground::Lines::last_up_to(double p) const {
    const double guess = (p - origin) * inverse_spacing;
    auto index = static_cast<std::int64_t>(guess);
    if (guess < static_cast<double>(index)) --index;  // the cast rounds towards zero
    if (p < at(index)) --index;
    if (p >= at(index + 1)) ++index;
    return index;
}

inline const Chunk* Ground::find_chunk(std::int64_t column, std::int64_t row) const {
    return resident_->find_chunk({static_cast<std::int32_t>(column >> kChunkShift),
                                  static_cast<std::int32_t>(row >> kChunkShift),
                                  static_cast<std::uint8_t>(level_)});
}

inline GroundCell Ground::read_cell(const Chunk& chunk, std::int64_t column, std::int64_t row) {
    GroundCell cell;
    const auto i = static_cast<int>(column & (kChunkCells - 1));
    const auto j = static_cast<int>(row & (kChunkCells - 1));
    const std::uint8_t flags = chunk.flags_at(i, j);
    if ((flags & cell_outside) != 0) return cell;
    cell.status = GroundStatus::ok;
    const std::size_t south_west = sample_index(i, j);
    cell.south_west = chunk.heights[south_west];
    cell.south_east = chunk.heights[south_west + 1];
    cell.north_west = chunk.heights[south_west + kChunkSamples];
    cell.north_east = chunk.heights[south_west + kChunkSamples + 1];
    cell.cut_to_north_east = cut_to_north_east(column, row);
    cell.error_m = chunk.cell_error(cell_index(i, j));
    cell.filled = (flags & cell_filled) != 0;
    return cell;
}

}  // namespace terrane
