// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cstdint>

namespace terrane::internal {

/// A range of columns or rows of chunks, both ends included; empty where last < first.
struct ChunkSpan {
    std::int64_t first = 0;
    std::int64_t last = -1;

    double count() const { return std::max(0.0, static_cast<double>(last - first) + 1.0); }
};

/// The columns or the rows of the chunks of one level.
struct ChunkAxis {
    double origin = 0.0;  ///< of lattice index 0, world, metres
    double side = 1.0;    ///< of a chunk, metres
    double inverse_side = 1.0;
    ChunkSpan world;  ///< all of the world

    /// The western or southern edge of a chunk: the bits of Lattice::x() and y().
    double edge(std::int64_t index) const { return origin + side * static_cast<double>(index); }

    /// Chunks of `within` that share a point with the closed interval from low to high. Unspecified for
    /// NaN.
    ChunkSpan touched(double low, double high, const ChunkSpan& within) const {
        std::int64_t first = index_at(low, within), last = index_at(high, within);
        // the index may be off by one, and neighbours share their edge
        if (edge(first + 1) < low) ++first;
        if (edge(first) >= low) --first;
        if (edge(last) > high) --last;
        if (edge(last + 1) <= high) ++last;
        return {std::max(first, within.first), std::min(last, within.last)};
    }

private:
    // Clamped to two beyond the span, so that it fits an integer.
    std::int64_t index_at(double place, const ChunkSpan& within) const {
        const double index = (place - origin) * inverse_side;
        if (!(index > static_cast<double>(within.first - 2))) return within.first - 2;
        if (!(index < static_cast<double>(within.last + 2))) return within.last + 2;
        const auto cut = static_cast<std::int64_t>(index);
        return static_cast<double>(cut) > index ? cut - 1 : cut;
    }
};

/// The chunks of one level.
struct ChunkGrid {
    ChunkGrid(const Lattice& lattice, int level)
        : x{lattice.origin_x,
            lattice.level_spacing(level) * kChunkCells,
            1.0 / (lattice.level_spacing(level) * kChunkCells),
            {}},
          y{lattice.origin_y, x.side, x.inverse_side, {}} {
        const auto span = [level](std::int32_t first_root, std::int32_t root_count) {
            const std::int64_t first = std::int64_t{first_root} << level;
            return ChunkSpan{first, first + (std::int64_t{root_count} << level) - 1};
        };
        x.world = span(lattice.first_root_x, lattice.root_count_x);
        y.world = span(lattice.first_root_y, lattice.root_count_y);
    }

    ChunkAxis x, y;
};

}  // namespace terrane::internal
