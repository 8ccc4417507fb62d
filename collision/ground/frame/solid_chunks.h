// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>

namespace terrane::internal {

/// log2 of the cells along the side of a chunk.
inline constexpr int kChunkLog2 = 7;
static_assert(1 << kChunkLog2 == kChunkCells);

/// Visits the solids of the chunks that a range of cells overlaps, with the part of the range in the chunk, cells
/// counted from its corner: take(const SolidSurface&, const CellRange& in_chunk).
template <class Take>
void visit_solids(const Ground& ground, const CellRange& cells, Take&& take) {
    constexpr std::int64_t kLast = kChunkCells - 1;
    for (std::int64_t row = cells.south >> kChunkLog2; row <= cells.north >> kChunkLog2; ++row) {
        for (std::int64_t column = cells.west >> kChunkLog2; column <= cells.east >> kChunkLog2;
             ++column) {
            const std::int64_t west = column << kChunkLog2, south = row << kChunkLog2;
            const SolidSurface* const solid = ground.solid(west, south);
            if (solid == nullptr) continue;
            take(*solid, CellRange{std::max(cells.west - west, std::int64_t{0}),
                                   std::max(cells.south - south, std::int64_t{0}),
                                   std::min(cells.east - west, kLast),
                                   std::min(cells.north - south, kLast)});
        }
    }
}

}  // namespace terrane::internal
