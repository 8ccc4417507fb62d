// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace terrane {

/// Blocks of 8 x 8 cells along the side of a chunk; each has its own interval of heights.
inline constexpr int kChunkBlocks = kChunkCells / 8;

/// Cells along the side of an area of a chunk, with its own interval and bounds.
inline constexpr int kAreaCells = 16;
inline constexpr int kChunkAreas = kChunkCells / kAreaCells;

/// One square of heights with the bounds that certify it: the unit of paging. Immutable once made.
///
/// Index of a sample: row * kChunkSamples + column, row 0 south, column 0 west. Index of a cell:
/// row * kChunkCells + column.
struct Chunk {
    ChunkKey key;
    LatticePoint corner;    ///< south-west corner
    std::int64_t step = 1;  ///< finest spacings between samples

    /// [kChunkSamples^2] multiples of Lattice::quantum; shared edges are the same integers.
    std::vector<std::int32_t> heights;

    /// [kChunkSamples^2] 1 / e(v)^2, rounded down, of the vertices that this level owns: those of spacing
    /// `step`, and in a root chunk all coarser ones too. e(v) is the certified bound, metres, half a
    /// quantum included. Infinite at other samples.
    std::vector<float> inverse_square_bounds;

    /// [kChunkCells^2] certified bound of the two triangles of each cell, metres, half a quantum
    /// included: how far the surface of this level may be from the true one.
    std::vector<float> cell_bounds;

    /// [kChunkCells^2] bits of CellFlag; empty where all cells are ground.
    std::vector<std::uint8_t> cell_flags;

    /// [kChunkBlocks^2] lowest and highest sample of each block of 8 x 8 cells, edges included.
    std::array<std::int32_t, kChunkBlocks * kChunkBlocks> block_low{};
    std::array<std::int32_t, kChunkBlocks * kChunkBlocks> block_high{};
    std::int32_t low = 0;   ///< lowest sample
    std::int32_t high = 0;  ///< highest sample

    float max_vertex_bound = 0.0f;
    /// Areas of 16 x 16 cells, row by row from the south-west, edges included.
    struct Area {
        std::int32_t low = 0;
        std::int32_t high = 0;
        float max_vertex_bound = 0.0f;
        float max_cell_bound = 0.0f;
    };
    std::array<Area, kChunkAreas * kChunkAreas> areas{};
    /// Largest cell bound of each quadrant: what the child there could at most improve on.
    std::array<float, 4> quadrant_bound{};

    std::uint8_t flags_at(int column, int row) const {
        return cell_flags.empty()
                   ? std::uint8_t{cell_ground}
                   : cell_flags[static_cast<std::size_t>(row * kChunkCells + column)];
    }

    /// What one chunk takes from the byte ceiling.
    static std::size_t max_bytes();
    std::size_t bytes() const;
};

/// A certified bound that 1 / e^2 stands for, rounded up.
float bound_of(float inverse_square_bound);

/// Index of a sample of a chunk.
constexpr std::size_t sample_index(int column, int row) {
    return static_cast<std::size_t>(row) * kChunkSamples + static_cast<std::size_t>(column);
}

/// Index of a cell of a chunk.
constexpr std::size_t cell_index(int column, int row) {
    return static_cast<std::size_t>(row) * kChunkCells + static_cast<std::size_t>(column);
}

/// Reads one chunk from its source.
///
/// Fails:   io where the source fails; bad_data where it gives NaN, infinity, or a height that is
///          no 32-bit multiple of the quantum
/// Threads: any
/// Cost:    about 10 times that of the chunk's samples, for the bounds
Result<std::shared_ptr<const Chunk>> make_chunk(const HeightSource& source, const ChunkKey& key);

}  // namespace terrane
