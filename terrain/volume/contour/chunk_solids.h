// SPDX-License-Identifier: MIT
#pragma once

#include "contour/tile_contour.h"

#include <terrane/terrain/chunk.h>
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

/// Tiles along the side of a chunk, and of a chunk: row by row from the south-west.
inline constexpr int kTilesPerChunk = kChunkCells / kVolumeTileCells;
inline constexpr int kChunkTiles = kTilesPerChunk * kTilesPerChunk;

/// The tile of a chunk of the pinned level.
VolumeTileKey tile_of(const ChunkKey& key, int tile);
/// The chunk of the pinned level that a tile is part of.
ChunkKey chunk_of(const VolumeTileKey& key, int level);
/// The samples of a tile, row by row.
std::vector<std::int32_t> tile_heights(const Chunk& chunk, int tile);

/// The level sets of a tile with their contour. Immutable.
struct TileSolid {
    VolumeTile level_set;
    VolumeContour contour;
    ContourErrors errors;                 ///< of the contour
    double farthest_from_ground_m = 0.0;  ///< vertical distance of the contour from the heightfield
    std::size_t bytes = 0;                ///< of all this

    /// @param operations those that the tile is made of, for its errors
    TileSolid(VolumeTile tile, std::span<const PlacedVolume* const> operations);
};

/// The tiles of a chunk; null where no volume touches one. Chunks that differ by a few operations share the others.
using ChunkTiles = std::array<std::shared_ptr<const TileSolid>, kChunkTiles>;

std::size_t bytes_of(const ChunkTiles& tiles);

/// The volumes that touch a tile.
std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const VolumeTileKey& tile);

/// Whether the coarser levels of detail are made: they take ten times as long as everything else.
enum class SolidLevels { none, all };

/// Puts the contours of a chunk together: null where they leave the heightfield as it is.
///
/// Cost: O(n log n) in their triangles
std::shared_ptr<const SolidSurface> make_solid(const Lattice& lattice, const Chunk& chunk,
                                               const ChunkTiles& tiles, SolidLevels levels);

/// Adds the coarser levels of a chunk's triangles. What is left of the heightfield, its border with the walls, and
/// vertices on the sides of the chunk stay, so that levels of neighbours fit.
void add_levels(const Lattice& lattice, const Chunk& chunk, SolidTriangles& solid);

/// Removes the vertices inside a cap, a part of a vertical plane.
void simplify_cap(std::span<const WorldPos> vertices,
                  std::vector<std::array<std::uint32_t, 3>>& cap, double spacing);

/// What volumes add to the heightfield over a chunk.
struct ChunkExtent {
    SolidExtent solid;
    double area = 0.0;  ///< upper estimate of the area of surfaces, m^2

    friend bool operator==(const ChunkExtent& a, const ChunkExtent& b) {
        return a.solid.error_m == b.solid.error_m && a.solid.heights.low == b.solid.heights.low &&
               a.solid.heights.high == b.solid.heights.high && a.area == b.area;
    }
};

/// Both together; areas add up.
std::optional<ChunkExtent> united(const std::optional<ChunkExtent>& a,
                                  const std::optional<ChunkExtent>& b);

/// What one operation adds to the heightfield over a tile that it touches; none if nothing.
///
/// Cost: that of HeightSource::interval()
std::optional<ChunkExtent> extent_of(const HeightSource& heights, const Volumes& volumes,
                                     VolumeOp op, const VolumeTilePart& part);

/// What volumes add to the heightfield over each chunk, of all levels: a function of the extents of the chunks of the
/// pinned level.
///
/// Below the heightfield only what was removed matters, above it only what was added. The heightfield alone leaves out
/// surfaces at most as far from it as their vertical distance, and its own points over a void are at most as far above
/// the floor there.
///
/// Threads: any number that read, or one that changes it
class SolidExtents {
public:
    SolidExtents(const HeightSource& heights, const Volumes& volumes);

    /// Of a chunk of any level; none where there is no volume. Cost: O(1)
    std::optional<ChunkExtent> of_chunk(const ChunkKey& key) const;
    /// Encloses the volumes over a rectangle; none where there are none. Cost: O(chunks of one level under it), which
    /// are at most 4
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Changes that of a chunk of the pinned level, and what follows from it above. Cost: O(levels)
    void set(const ChunkKey& key, const std::optional<ChunkExtent>& extent);

private:
    Lattice lattice_;
    std::unordered_map<ChunkKey, ChunkExtent, ChunkKeyHash> chunks_;  // order does not matter
};

}  // namespace terrane::internal
