// SPDX-License-Identifier: MIT
#include "ground/ray_walk.h"

#include <terrane/base/result.h>

#include <algorithm>

namespace terrane {

// Null if the chunk is not resident.
const Chunk* GroundReader::chunk_of(std::int64_t column, std::int64_t row) {
    if (chunk_ != nullptr && column >> kChunkShift == chunk_column_ &&
        row >> kChunkShift == chunk_row_) {
        return chunk_;
    }
    const Chunk* const found = ground_->find_chunk(column, row);
    if (found == nullptr) return nullptr;
    chunk_column_ = column >> kChunkShift;
    chunk_row_ = row >> kChunkShift;
    return chunk_ = found;
}

RangeAnswer GroundReader::square(std::int64_t column, std::int64_t row, int log2_side) {
    TERRANE_ASSERT(log2_side >= 0 && log2_side <= kChunkShift,
                   "a square has 1 << 0 to 1 << 7 cells along its side");
    const std::int64_t side = std::int64_t{1} << log2_side;
    const std::int64_t west = column & -side;
    const std::int64_t south = row & -side;
    const CellRange& in_extent = ground_->in_extent_;
    const bool is_near = west <= in_extent.east && west + side > in_extent.west &&
                         south <= in_extent.north && south + side > in_extent.south;
    const Chunk* const chunk = is_near ? chunk_of(west, south) : nullptr;
    if (chunk == nullptr) {
        return ground_->range({west, south, west + side - 1, south + side - 1});
    }
    const int i = static_cast<int>(west & (kChunkCells - 1));
    const int j = static_cast<int>(south & (kChunkCells - 1));
    const SampleRange range = chunk->samples_in(log2_side, i, j);
    return {QueryStatus::ok, range.low, range.high};
}

GroundCell GroundReader::cell(std::int64_t column, std::int64_t row) {
    GroundCell cell;
    if (!ground_->is_in_extent(column, row)) return cell;
    const Chunk* const found = chunk_of(column, row);
    if (found == nullptr) {
        cell.status = QueryStatus::not_resident;
        return cell;
    }
    return Ground::read_cell(*found, column, row);
}

// Calls visitor(chunk, part) for each resident chunk that overlaps the range within the extent; `part` is the overlap.
template <class Visitor>
void GroundReader::visit_chunks(const CellRange& range, Visitor visitor) {
    const CellRange& in_extent = ground_->in_extent_;
    const std::int64_t last_east = std::min(range.east, in_extent.east);
    const std::int64_t last_north = std::min(range.north, in_extent.north);
    for (std::int64_t south = std::max(range.south, in_extent.south); south <= last_north;) {
        const std::int64_t north = std::min(last_north, south | (kChunkCells - 1));
        for (std::int64_t west = std::max(range.west, in_extent.west); west <= last_east;) {
            const std::int64_t east = std::min(last_east, west | (kChunkCells - 1));
            if (const Chunk* const chunk = chunk_of(west, south)) {
                visitor(*chunk, CellRange{west, south, east, north});
            }
            west = east + 1;
        }
        south = north + 1;
    }
}

void GroundReader::heights(const CellRange& range, std::size_t stride,
                           std::span<std::int32_t> heights_out,
                           std::span<std::uint32_t> ground_out) {
    const auto all_rows = static_cast<std::size_t>(range.north - range.south) + 1;
    std::fill_n(heights_out.begin(), (all_rows + 1) * stride, 0);
    std::fill_n(ground_out.begin(), all_rows, 0u);
    visit_chunks(range, [&](const Chunk& chunk, const CellRange& part) {
        const auto columns = static_cast<std::size_t>(part.east - part.west) + 1;
        const auto rows = static_cast<std::size_t>(part.north - part.south) + 1;
        const auto first_column = static_cast<std::size_t>(part.west - range.west);
        const auto first_row = static_cast<std::size_t>(part.south - range.south);
        const int i = static_cast<int>(part.west & (kChunkCells - 1));
        const int j = static_cast<int>(part.south & (kChunkCells - 1));
        const std::int32_t* from = chunk.heights.data() + sample_index(i, j);
        std::int32_t* to = heights_out.data() + first_row * stride + first_column;
        for (std::size_t row = 0; row <= rows; ++row) {
            std::copy_n(from + row * kChunkSamples, columns + 1, to + row * stride);
        }
        for (std::size_t row = 0; row < rows; ++row) {
            std::uint32_t bits = (columns < 32 ? std::uint32_t{1} << columns : 0u) - 1u;
            const std::size_t first = cell_index(i, j) + row * kChunkCells;
            for (std::size_t cell = 0; cell < columns && !chunk.cell_flags.empty(); ++cell) {
                if ((chunk.cell_flags[first + cell] & cell_outside) != 0) {
                    bits &= ~(std::uint32_t{1} << cell);
                }
            }
            ground_out[first_row + row] |= bits << first_column;
        }
    });
}

bool GroundReader::is_all_ground(const CellRange& range) {
    if (!ground_->is_within_extent(range)) return false;
    std::int64_t count = 0;
    visit_chunks(range, [&](const Chunk& chunk, const CellRange& part) {
        const std::int64_t columns = part.east - part.west + 1;
        if (chunk.cell_flags.empty()) {
            count += columns * (part.north - part.south + 1);
            return;
        }
        for (std::int64_t row = part.south; row <= part.north; ++row) {
            const auto first =
                chunk.cell_flags.begin() + static_cast<std::ptrdiff_t>(cell_index(
                                               static_cast<int>(part.west & (kChunkCells - 1)),
                                               static_cast<int>(row & (kChunkCells - 1))));
            count += std::count_if(first, first + columns,
                                   [](std::uint8_t flags) { return (flags & cell_outside) == 0; });
        }
    });
    return count == (range.east - range.west + 1) * (range.north - range.south + 1);
}

float GroundReader::error(const CellRange& range) {
    float error = 0.0f;
    visit_chunks(range, [&](const Chunk& chunk, const CellRange& part) {
        for (std::int64_t row = part.south; row <= part.north; ++row) {
            for (std::int64_t column = part.west; column <= part.east; ++column) {
                const int i = static_cast<int>(column & (kChunkCells - 1));
                const int j = static_cast<int>(row & (kChunkCells - 1));
                if ((chunk.flags_at(i, j) & cell_outside) == 0) {
                    error = std::max(error, chunk.cell_error(cell_index(i, j)));
                }
            }
        }
    });
    return error;
}

}  // namespace terrane
