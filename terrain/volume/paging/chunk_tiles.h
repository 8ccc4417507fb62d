// SPDX-License-Identifier: MIT
#pragma once

#include "contour/contour_error.h"

#include <terrane/terrain/chunk.h>
#include <terrane/volume/volume_tile.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
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

}  // namespace terrane::internal
