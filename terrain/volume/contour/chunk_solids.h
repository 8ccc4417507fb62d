// SPDX-License-Identifier: MIT
#pragma once

#include "contour/tile_contour.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/height_source.h>
#include <terrane/volume/volume_tile.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// Number of tiles along the side of a chunk, and in a chunk. Tiles are counted row by row from the south-west.
inline constexpr int kTilesPerChunk = kChunkCells / kVolumeTileCells;
inline constexpr int kChunkTiles = kTilesPerChunk * kTilesPerChunk;

/// Key of a tile of a chunk of the pinned level.
VolumeTileKey tile_of(const ChunkKey& key, int tile);
/// The chunk of the pinned level that contains a tile.
ChunkKey chunk_of(const VolumeTileKey& key, int level);
/// The samples of a tile, row by row.
std::vector<std::int32_t> tile_heights(const Chunk& chunk, int tile);

/// A tile's level sets and their contour. Immutable.
struct TileSolid {
    VolumeTile level_set;
    VolumeContour contour;
    ContourErrors errors;                 ///< of the contour
    double farthest_from_ground_m = 0.0;  ///< largest vertical distance from the heightfield
    std::size_t bytes = 0;                ///< of level sets, contour and errors

    /// @param operations that touch the tile: bounds of its errors follow from them
    TileSolid(VolumeTile tile, std::span<const PlacedVolume* const> operations);
};

/// The tiles of a chunk; a tile that no volume touches is null. Versions of a chunk share tiles that do not differ.
using ChunkTiles = std::array<std::shared_ptr<const TileSolid>, kChunkTiles>;

std::size_t bytes_of(const ChunkTiles& tiles);

/// The volumes that touch a tile.
std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const VolumeTileKey& tile);

/// Whether to make the coarser levels of detail, which take ten times as long as everything else.
enum class SolidLevels { none, all };

/// Joins the contours of a chunk's tiles; null if they leave the heightfield unchanged.
///
/// Cost: O(n log n) for n triangles
std::shared_ptr<const SolidSurface> make_solid(const Lattice& lattice, const Chunk& chunk,
                                               const ChunkTiles& tiles, SolidLevels levels);

/// Adds the coarser levels of detail of a chunk's triangles. Remainders of the heightfield, its border with the walls,
/// and vertices on the sides of the chunk are kept, so that levels of neighbouring chunks fit.
void add_levels(const Lattice& lattice, const Chunk& chunk, SolidTriangles& solid);

/// Removes vertices from the interior of a cap, which is planar.
void simplify_cap(std::span<const WorldPos> vertices,
                  std::vector<std::array<std::uint32_t, 3>>& cap, double spacing);

/// The extent of volumes over a chunk.
struct ChunkExtent {
    SolidExtent solid;
    double area = 0.0;  ///< upper estimate of the surfaces' area, m^2

    friend bool operator==(const ChunkExtent& a, const ChunkExtent& b) {
        return a.solid.error_m == b.solid.error_m && a.solid.heights.low == b.solid.heights.low &&
               a.solid.heights.high == b.solid.heights.high && a.area == b.area;
    }
};

/// The union of two extents; areas add up.
std::optional<ChunkExtent> united(const std::optional<ChunkExtent>& a,
                                  const std::optional<ChunkExtent>& b);

/// Extent of one operation over a tile that it touches; absent if it changes nothing there.
///
/// Cost: one call of HeightSource::interval()
std::optional<ChunkExtent> extent_of(const HeightSource& heights, const Volumes& volumes,
                                     VolumeOp op, const VolumeTilePart& part);

/// Extents of volumes over chunks of all levels. The extents of coarser levels follow from the pinned level.
///
/// Below the heightfield only removed shapes matter, above it only added ones. The error of the heightfield alone
/// (SolidExtent::error_m) is bounded by the largest vertical distance of these shapes' surfaces from the heightfield:
/// no surface that it lacks is farther away, and where it spans a void, it is no higher above the void's floor.
///
/// Threads: any number of readers, or one thread that changes it
class SolidExtents {
public:
    SolidExtents(const HeightSource& heights, const Volumes& volumes);

    /// Extent over a chunk of any level; absent if there is no volume. Cost: O(1)
    std::optional<ChunkExtent> of_chunk(const ChunkKey& key) const;
    /// Interval of z that encloses the volumes over a rectangle; absent if there are none.
    ///
    /// Cost: O(chunks of one level under the rectangle), usually at most 4
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Sets the extent of a chunk of the pinned level and updates its ancestors. Cost: O(levels)
    void set(const ChunkKey& key, const std::optional<ChunkExtent>& extent);

private:
    Lattice lattice_;
    std::unordered_map<ChunkKey, ChunkExtent, ChunkKeyHash> chunks_;  // order does not matter
};

}  // namespace terrane::internal
