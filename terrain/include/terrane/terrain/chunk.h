// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/lattice.h>
#include <terrane/terrain/solid_surface.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

namespace terrane {

/// Lowest and highest of some samples, quanta.
struct SampleRange {
    std::int32_t low = 0;   ///< lowest sample
    std::int32_t high = 0;  ///< highest sample
    friend constexpr bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// Lowest and highest sample of each square of 4, 8, ... 128 cells a side in a chunk, edges included. Squares are
/// aligned to their size.
class SamplePyramid {
public:
    /// log2 of the cells along the side of the smallest squares.
    static constexpr int kFinest = 2;
    static constexpr int kCoarsest = 7;  ///< as kFinest, for the largest squares
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
        // number of all smaller squares: a geometric series
        const int first = ((1 << 12) - (1 << (16 - 2 * log2_side))) / 3;
        return static_cast<std::size_t>(first + ((row >> log2_side) << (kCoarsest - log2_side)) +
                                        (column >> log2_side));
    }
    std::array<SampleRange, 1365> ranges_{};  // fine to coarse; row by row from the south-west
};

/// Cells along the side of an area: the part of a chunk that has its own interval and bounds.
inline constexpr int kAreaCells = 16;
inline constexpr int kChunkAreas = kChunkCells / kAreaCells;  ///< areas along the side of a chunk

namespace internal {
struct ChunkVertices;
}

/// One square of heights with certified bounds: the unit of paging. Immutable after construction.
///
/// Index of a sample: row * kChunkSamples + column, row 0 south, column 0 west. Index of a cell:
/// row * kChunkCells + column.
struct Chunk {
    ChunkKey key;  ///< level and position
    /// Number of the last change of volumes that the chunk includes, for ChunkSource::is_current(); 0 if there is none.
    std::uint32_t change = 0;
    LatticePoint corner;    ///< south-west corner
    std::int64_t step = 1;  ///< finest spacings between samples

    /// [kChunkSamples^2] in units of Lattice::quantum; chunks have the same integers on shared edges.
    std::vector<std::int32_t> heights;

    /// Bounds and reaches of the vertices, for level of detail; internal to Terrane. Never null in a chunk from
    /// make_chunk(). Copies of a chunk share it.
    std::shared_ptr<const internal::ChunkVertices> vertices;
    /// Interval of heights, world z, metres, that contains the true surface over the diamonds of the chunk's own
    /// vertices and of most of their descendants.
    HeightInterval vertex_reach;

    /// [kChunkCells^2] certified bound of the vertical distance between the two triangles of a cell and the true
    /// surface, metres, including half a quantum. An estimate if the chunk is not certified: see cell_error().
    std::vector<float> cell_bounds;

    /// [kChunkCells^2] a byte of CellFlag bits for each cell; empty if all cells are ground.
    std::vector<std::uint8_t> cell_flags;

    /// The surface where volumes change the heightfield; null, at no cost, if no volume touches the chunk.
    std::shared_ptr<const SolidSurface> solid;

    SamplePyramid pyramid;  ///< lowest and highest samples of squares of 4 to 128 cells
    std::int32_t low = 0;   ///< lowest sample
    std::int32_t high = 0;  ///< highest sample

    float max_vertex_bound = 0.0f;  ///< largest bound of the chunk's vertices, metres
    /// A square of 16 x 16 cells, edges included.
    struct Area {
        std::int32_t low = 0;           ///< lowest sample
        std::int32_t high = 0;          ///< highest sample
        float max_vertex_bound = 0.0f;  ///< largest bound of its vertices, metres
        float max_cell_bound = 0.0f;    ///< largest bound of its cells, metres
    };
    std::array<Area, kChunkAreas * kChunkAreas> areas{};  ///< row by row from the south-west
    /// Largest cell bound of each quadrant, metres: the error that can be reduced by loading the child there.
    std::array<float, 4> quadrant_bound{};
    bool is_certified = true;  ///< HeightSource::is_certified() of the source

    /// Lowest and highest sample, quanta, of the square that contains a cell, edges included. Squares have 1 <<
    /// log2_side cells a side (log2_side 0 to 7), and are aligned to their size.
    SampleRange samples_in(int log2_side, int column, int row) const {
        return log2_side >= SamplePyramid::kFinest ? pyramid.at(log2_side, column, row)
                                                   : samples_in_small(log2_side, column, row);
    }
    /// Certified error of a cell, metres: its bound, or infinity if the chunk is not certified.
    float cell_error(std::size_t cell) const {
        return is_certified ? cell_bounds[cell] : std::numeric_limits<float>::infinity();
    }
    /// CellFlag bits of a cell of the chunk.
    std::uint8_t flags_at(int column, int row) const {
        return cell_flags.empty()
                   ? std::uint8_t{cell_ground}
                   : cell_flags[static_cast<std::size_t>(row * kChunkCells + column)];
    }

    /// Largest size of a chunk without volumes, bytes: what its load claims from the memory ceiling.
    static std::size_t max_bytes();
    /// Size of this chunk, bytes.
    std::size_t bytes() const;

private:
    SampleRange samples_in_small(int log2_side, int column, int row) const;
};

/// Index of a sample of a chunk.
constexpr std::size_t sample_index(int column, int row) {
    return static_cast<std::size_t>(row) * kChunkSamples + static_cast<std::size_t>(column);
}

/// Index of a cell of a chunk.
constexpr std::size_t cell_index(int column, int row) {
    return static_cast<std::size_t>(row) * kChunkCells + static_cast<std::size_t>(column);
}

/// Gets one chunk from its source: a stored chunk (ChunkSource::stored_chunk()), or one computed from samples and
/// bounds.
///
/// @param stop checked between calls of the source
///
/// Fails:   io if the source fails; bad_data if the source returns NaN, a height beyond kMostHeight or kMostQuanta, a
///          bound beyond four times kMostHeight, or bounds that its own samples contradict; cancelled if `stop` is
///          requested
/// Asserts: checks at some points that heights of the chunk are within the source's interval and bounds
/// Threads: any
/// Cost:    about 10 times the cost of the chunk's samples, because of the bounds
Result<std::shared_ptr<const Chunk>> make_chunk(const HeightSource& source, const ChunkKey& key,
                                                const std::stop_token& stop = {});

}  // namespace terrane
