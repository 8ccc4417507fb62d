// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

// The private part of Chunk: the triangulator's data apart from the samples. Besides terrain itself, only
// terrane::store, which serialises it, and tests may include this header.

namespace terrane::internal {

/// Number of squares of 2 x 2 cells along the side of an area, and of a chunk.
inline constexpr int kAreaSquares = kAreaCells / 2;
inline constexpr int kChunkSquares = kChunkCells / 2;

/// The upper half of a float, which is thereby rounded towards 0: sign, exponent and seven bits of the mantissa.
inline std::uint16_t upper_half(float value) {
    return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(value) >> 16);
}
inline float from_upper_half(std::uint16_t half) {
    return std::bit_cast<float>(std::uint32_t{half} << 16);
}

/// The vertices of a chunk's own spacing in one area: three per square. Index of a square: row * kAreaSquares + column,
/// from the south-west.
struct AreaVertices {
    /// Centre of a square; midpoint of its southern side; midpoint of its western side. Midpoints on an area's eastern
    /// and northern side belong to the adjacent area.
    enum Kind : std::size_t { centre = 0, along_x = 1, along_y = 2 };
    static constexpr std::size_t kKinds = 3;
    static constexpr std::size_t kSquares = std::size_t{kAreaSquares} * kAreaSquares;
    template <typename Value>
    using PerVertex = std::array<std::array<Value, kSquares>, kKinds>;

    /// Storage location of the values of a vertex of the chunk's own spacing.
    struct Address {
        std::size_t area, kind, square;
    };
    /// @param column, row of the vertex's sample, 0 to kChunkCells - 1, not both even
    static constexpr Address address_of(int column, int row) {
        const int area = row / kAreaCells * kChunkAreas + column / kAreaCells;
        const int square = row % kAreaCells / 2 * kAreaSquares + column % kAreaCells / 2;
        const Kind kind = row % 2 == 0 ? along_x : column % 2 == 0 ? along_y : centre;
        return {static_cast<std::size_t>(area), kind, static_cast<std::size_t>(square)};
    }

    /// 1 / e(v)^2, rounded down to the upper half of a float: see upper_half(). e(v) is the certified bound, metres,
    /// including half a quantum.
    alignas(64) PerVertex<std::uint16_t> inverse_square_bounds;
    /// Limits of the vertex's reach, rounded outward: heights relative to ChunkVertices::reach_base, in reach_unit.
    /// They enclose the true surface over the vertex's diamond, with a margin for the reaches of its descendants.
    PerVertex<std::int16_t> low, high;
    /// Height of the vertex above the middle of the edge that it splits, in rise_unit.
    PerVertex<std::int16_t> rise;
    float rise_unit = 1.0f;  ///< metres, a power of two
};

/// The midpoints on one side of a chunk, from the south or west.
struct SideVertices {
    std::array<std::uint16_t, kChunkSquares> inverse_square_bounds{};
    std::array<std::int16_t, kChunkSquares> low{}, high{};
};

/// Quantised bounds and reaches of a chunk's vertices.
struct ChunkVertices {
    static constexpr std::size_t kCoarseStrides = 6;  ///< strides 1, 2 .. kChunkSquares / 2
    /// Row by row from the south-west.
    std::array<AreaVertices, std::size_t{kChunkAreas} * kChunkAreas> areas;
    /// Limits of the reaches of all vertices of an area, including those on the chunk's eastern and northern side;
    /// units as for AreaVertices::low and high.
    struct AreaReach {
        std::int16_t low = 0;
        std::int16_t high = 0;
    };
    std::array<AreaReach, std::size_t{kChunkAreas} * kChunkAreas> area_reaches{};
    /// Midpoints on these sides. They belong to the neighbouring chunks and have the same bounds there.
    SideVertices east_side, north_side;
    double reach_base = 0.0;  ///< metres
    float reach_unit = 1.0f;  ///< metres, a power of two
    /// In root chunks: 1 / e(v)^2 of the vertices of coarser spacings, [(kChunkSquares + 1)^2] at every second sample
    /// of every second row; infinite at the corners. Empty in other chunks.
    std::vector<float> coarse_bounds;
    /// [log2 of the stride in even samples] In root chunks: largest bound e(v) of the vertices of coarser spacings with
    /// this stride, metres, rounded up.
    std::array<float, kCoarseStrides> largest_coarse_bounds{};

    /// Union of the height intervals of the reaches of an area's vertices, world z, metres.
    HeightInterval reach_of_area(int area) const {
        const AreaReach& reach = area_reaches[static_cast<std::size_t>(area)];
        return metres(reach.low, reach.high);
    }
    HeightInterval metres(std::int16_t low_units, std::int16_t high_units) const {
        const auto unit = static_cast<double>(reach_unit);
        return {reach_base + unit * low_units, reach_base + unit * high_units};
    }
    /// 1 / e(v)^2 of the vertex at a sample; infinite if a coarser chunk owns it.
    float inverse_square_bound(int column, int row) const;
};

/// Converts a stored inverse square to its bound, rounded up.
float bound_of(float inverse_square_bound);

/// Computes the fields of a chunk that need not be stored, because they follow from others: pyramid, low and high,
/// areas except max_vertex_bound, quadrant_bound, vertex_reach; in `vertices` the reaches of areas, rises and largest
/// coarse bounds. Then moves `vertices` into the chunk.
///
/// Requires: heights, cell_bounds and max_vertex_bound (also of areas) of the chunk; bounds, low and high of all
///           vertices and both sides, reach_base and reach_unit
///
/// @param quantum Lattice::quantum, metres
void complete_chunk(double quantum, std::shared_ptr<ChunkVertices> vertices, Chunk& chunk);

/// Margin around a chunk, in cells of its spacing, into which the reaches of its vertices extend. The reach of a vertex
/// is a box that encloses the true surface over its diamond and the reaches of its descendants: see screen_error.h.
inline constexpr int kReachCells = 2;
inline constexpr int kWideCells = kChunkCells + 2 * kReachCells;
inline constexpr int kWideSamples = kWideCells + 1;

/// Bounds of half the height of a vertex's reach, metres, from the source's rise bound. The bound of a centre includes
/// the bounds of its midpoints; the bound of a midpoint includes the bounds of its centres of half the spacing.
struct ReachHeights {
    double of_centre = 0.0;
    double of_midpoint = 0.0;
};
ReachHeights reach_heights(const HeightSource& source, double spacing);

/// Sets reach_base, reach_unit, and low and high of all vertices.
///
/// @param heights [kWideSamples^2] metres, of the chunk and a margin of kReachCells
/// @param bounds  [kWideCells^2] certified bounds of the cells, metres
void fill_reaches(std::span<const double> heights, std::span<const float> bounds,
                  const HeightSource& source, const Chunk& chunk, ChunkVertices& vertices_out);

/// The largest bounds of a chunk's vertices, metres.
struct MostBounds {
    float of_chunk = 0.0f;
    std::array<float, std::size_t{kChunkAreas} * kChunkAreas> of_areas{};
};

/// Makes a chunk from known bounds of its vertices. Computes heights, cells and reaches as make_chunk() does.
///
/// @param vertices with the bounds of all vertices and of both sides; for a root also the coarse bounds
///
/// Fails: as make_chunk()
Result<std::shared_ptr<const Chunk>> make_bounded_chunk(const HeightSource& source,
                                                        const ChunkKey& key,
                                                        std::shared_ptr<ChunkVertices> vertices,
                                                        const MostBounds& most,
                                                        const std::stop_token& stop);

/// Makes a chunk as make_chunk() does, but without reaches, pyramid, and what areas and quadrants hold besides bounds
/// of vertices: a store computes these from the other fields when the chunk is read.
///
/// @param with_vertex_bounds false: without Chunk::vertices
///
/// Fails: as make_chunk()
Result<std::shared_ptr<const Chunk>> make_chunk_without_reaches(const HeightSource& source,
                                                                const ChunkKey& key,
                                                                bool with_vertex_bounds);

/// Computes the reaches of the areas and the chunk from the reaches of the vertices, and the rises of the vertices.
void derive_reaches(double quantum, ChunkVertices& vertices, Chunk& chunk);

}  // namespace terrane::internal
