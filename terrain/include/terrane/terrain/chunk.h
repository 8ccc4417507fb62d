// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/sample_pyramid.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <vector>

namespace terrane {

/// Cells along the side of an area of a chunk, with its own interval and bounds.
inline constexpr int kAreaCells = 16;
inline constexpr int kChunkAreas = kChunkCells / kAreaCells;

/// Squares of 2 x 2 cells along the side of an area, and of a chunk.
inline constexpr int kAreaSquares = kAreaCells / 2;
inline constexpr int kChunkSquares = kChunkCells / 2;

/// The sign, the exponent and seven bits of a float: not larger, where it is positive.
inline std::uint16_t upper_half(float value) {
    return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(value) >> 16);
}
inline float from_upper_half(std::uint16_t half) {
    return std::bit_cast<float>(std::uint32_t{half} << 16);
}

/// The vertices of a chunk's own spacing, as the triangulator reads them: three for each square of
/// an area. Index of a square: row * kAreaSquares + column, from the south-west.
struct AreaVertices {
    /// In the middle of a square; on its southern side; on its western side. Midpoints on an area's
    /// east and north are the next area's.
    enum Kind : std::size_t { centre = 0, along_x = 1, along_y = 2 };
    static constexpr std::size_t kKinds = 3;
    static constexpr std::size_t kSquares = std::size_t{kAreaSquares} * kAreaSquares;
    template <typename Value>
    using PerVertex = std::array<std::array<Value, kSquares>, kKinds>;

    struct Address {
        std::size_t area, kind, square;
    };
    /// Of an own vertex by its sample, columns and rows below kChunkCells, not both even.
    static constexpr Address address_of(int column, int row) {
        const int area = row / kAreaCells * (kChunkCells / kAreaCells) + column / kAreaCells;
        const int square = row % kAreaCells / 2 * kAreaSquares + column % kAreaCells / 2;
        const Kind kind = row % 2 == 0 ? along_x : column % 2 == 0 ? along_y : centre;
        return {static_cast<std::size_t>(area), kind, static_cast<std::size_t>(square)};
    }

    /// 1 / e(v)^2, rounded down to the upper half of a float's bits: see upper_half(). e(v) is the
    /// certified bound, metres, half a quantum included.
    alignas(64) PerVertex<std::uint16_t> inverse_square_bounds;
    /// How low and how high the reach of a vertex goes, in Chunk::reach_unit from Chunk::reach_base,
    /// rounded outward: the heights of the true surface over its diamond, with a margin that makes
    /// it hold the reaches of nearly all that is below it.
    PerVertex<std::int16_t> low, high;
    /// How much a vertex lies over the middle of the edge that it splits, in rise_unit.
    PerVertex<std::int16_t> rise;
    float rise_unit = 1.0f;  ///< metres, a power of two
};

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

    /// [kChunkAreas^2] row by row from the south-west.
    std::vector<AreaVertices> vertices;
    /// Of the midpoints on the chunk's eastern side from the south, and on its northern side from the
    /// west. The neighbours have the same bounds for them.
    struct SideVertices {
        std::array<std::uint16_t, kChunkSquares> inverse_square_bounds{};
        std::array<std::int16_t, kChunkSquares> low{}, high{};
    };
    SideVertices east_side, north_side;
    double reach_base = 0.0;     ///< metres
    float reach_unit = 1.0f;     ///< metres, a power of two
    std::int16_t reach_low = 0;  ///< of all of them
    std::int16_t reach_high = 0;
    /// Root chunks: [(kChunkSquares + 1)^2] 1 / e(v)^2 of the vertices of coarser spacings, of every
    /// second sample of every second row. Empty in others.
    std::vector<float> coarse_bounds;

    /// [kChunkCells^2] certified bound of the two triangles of each cell, metres, half a quantum
    /// included: how far the surface of this level may be from the true one.
    std::vector<float> cell_bounds;

    /// [kChunkCells^2] bits of CellFlag; empty where all cells are ground.
    std::vector<std::uint8_t> cell_flags;

    SamplePyramid pyramid;
    std::int32_t low = 0;   ///< lowest sample
    std::int32_t high = 0;  ///< highest sample

    float max_vertex_bound = 0.0f;
    /// Areas of 16 x 16 cells, row by row from the south-west, edges included.
    struct Area {
        std::int32_t low = 0;
        std::int32_t high = 0;
        float max_vertex_bound = 0.0f;
        float max_cell_bound = 0.0f;
        std::int16_t reach_low = 0;  ///< of its vertices, and those on the chunk's far sides
        std::int16_t reach_high = 0;
    };
    std::array<Area, kChunkAreas * kChunkAreas> areas{};
    /// Largest cell bound of each quadrant: what the child there could at most improve on.
    std::array<float, 4> quadrant_bound{};

    /// Lowest and highest sample of the square of 1 << log2_side cells along the side, 0 to 7, aligned to
    /// its size, that a cell lies in; edges included.
    SampleRange samples_in(int log2_side, int column, int row) const {
        return log2_side >= SamplePyramid::kFinest ? pyramid.at(log2_side, column, row)
                                                   : samples_in_small(log2_side, column, row);
    }
    /// Heights that the reaches of its own vertices take in, or those of an area, world, metres.
    HeightInterval reach() const { return metres(reach_low, reach_high); }
    HeightInterval reach_of_area(int area) const {
        const Area& part = areas[static_cast<std::size_t>(area)];
        return metres(part.reach_low, part.reach_high);
    }
    /// 1 / e(v)^2 of the vertex at a sample. Infinite where a coarser chunk owns it.
    float inverse_square_bound(int column, int row) const;

    std::uint8_t flags_at(int column, int row) const {
        return cell_flags.empty()
                   ? std::uint8_t{cell_ground}
                   : cell_flags[static_cast<std::size_t>(row * kChunkCells + column)];
    }

    /// What one chunk takes from the byte ceiling.
    static std::size_t max_bytes();
    std::size_t bytes() const;

private:
    SampleRange samples_in_small(int log2_side, int column, int row) const;
    HeightInterval metres(std::int16_t low_units, std::int16_t high_units) const {
        const auto unit = static_cast<double>(reach_unit);
        return {reach_base + unit * low_units, reach_base + unit * high_units};
    }
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

/// Fills what follows from a chunk's other fields: pyramid, low and high, rises, all of `areas` but
/// max_vertex_bound, quadrant_bound, and the chunk's own reach. What a source that keeps chunks need not keep.
/// Requires heights, vertices with bounds, low and high, both sides, and cell_bounds.
///
/// @param quantum of the lattice, metres
void complete_chunk(double quantum, Chunk& chunk);

/// Reads one chunk from its source: the one that it holds (HeightSource::stored_chunk()), or one made of its
/// answers.
///
/// @param stop asked for between one question to the source and the next
///
/// Fails:   io where the source fails; bad_data where it gives NaN, a height beyond kMostHeight or
///          kMostQuanta, a bound beyond four times kMostHeight, or bounds below what its own samples
///          show; cancelled where `stop` was requested meanwhile
/// Asserts: builds with asserts also compare some heights of the chunk with the source's interval
///          and bounds, as check_source() does for all of it
/// Threads: any
/// Cost:    about 10 times that of the chunk's samples, for the bounds
Result<std::shared_ptr<const Chunk>> make_chunk(const HeightSource& source, const ChunkKey& key,
                                                const std::stop_token& stop = {});

}  // namespace terrane
