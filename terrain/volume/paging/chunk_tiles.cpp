// SPDX-License-Identifier: MIT
#include "paging/chunk_tiles.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Which sides of a tile are sides of its chunk: west, east, south, north.
std::array<bool, 4> sides_of_chunk(const VolumeTileKey& key) {
    const auto place = [](std::int64_t i) {
        return (i % kTilesPerChunk + kTilesPerChunk) % kTilesPerChunk;
    };
    return {place(key.column) == 0, place(key.column) == kTilesPerChunk - 1, place(key.row) == 0,
            place(key.row) == kTilesPerChunk - 1};
}

/// Largest vertical distance of a contour's vertices from the heightfield, metres. Vertical distance is linear along
/// each triangle of a contour, so this bounds that of all its points; and where the heightfield is replaced, a part of
/// the contour is above or below it.
double farthest_from_ground(const VolumeTile& tile, const VolumeContour& contour) {
    const auto ground = [&](const VolumeNode& node) {
        return tile.ground(static_cast<int>(node.column - contour.key.column * kVolumeTileCells),
                           static_cast<int>(node.row - contour.key.row * kVolumeTileCells));
    };
    double farthest = 0.0;
    for (std::size_t i = 0; i < contour.keys.size(); ++i) {
        const WorldPos first = ground(contour.keys[i].first),
                       second = ground(contour.keys[i].second);
        const WorldPos& p = contour.positions_world[i];
        const Eigen::Vector2d along = (second - first).head<2>();
        const double length = along.squaredNorm();
        const double t = length > 0.0 ? (p - first).head<2>().dot(along) / length : 0.0;
        const double height = first.z() + t * (second.z() - first.z());
        farthest = std::max(farthest, std::abs(height - p.z()));
    }
    return farthest * (1.0 + 1e-12) + 1e-9;
}

}  // namespace

VolumeTileKey tile_of(const ChunkKey& key, int tile) {
    return {std::int64_t{key.x} * kTilesPerChunk + tile % kTilesPerChunk,
            std::int64_t{key.y} * kTilesPerChunk + tile / kTilesPerChunk};
}

ChunkKey chunk_of(const VolumeTileKey& key, int level) {
    const auto divide = [](std::int64_t a) {
        return static_cast<std::int32_t>(a / kTilesPerChunk - (a % kTilesPerChunk < 0 ? 1 : 0));
    };
    return {divide(key.column), divide(key.row), static_cast<std::uint8_t>(level)};
}

std::vector<std::int32_t> tile_heights(const Chunk& chunk, int tile) {
    std::vector<std::int32_t> heights;
    heights.reserve(static_cast<std::size_t>(kVolumeTileSamples) * kVolumeTileSamples);
    const int column = tile % kTilesPerChunk * kVolumeTileCells;
    const int first_row = tile / kTilesPerChunk * kVolumeTileCells;
    for (int row = first_row; row < first_row + kVolumeTileSamples; ++row) {
        const auto first =
            chunk.heights.begin() + static_cast<std::ptrdiff_t>(sample_index(column, row));
        heights.insert(heights.end(), first, first + kVolumeTileSamples);
    }
    return heights;
}

std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const VolumeTileKey& tile) {
    std::vector<const PlacedVolume*> operations;
    for (const std::uint32_t i : volumes.operations_at(tile))
        operations.push_back(&volumes.operations()[i]);
    return operations;
}

TileSolid::TileSolid(VolumeTile tile, std::span<const PlacedVolume* const> operations)
    : level_set(std::move(tile)),
      contour(level_set.contour(sides_of_chunk(level_set.key()))),
      errors(bound_errors(contour, level_set, operations)),
      farthest_from_ground_m(farthest_from_ground(level_set, contour)) {
    for (auto& cap : contour.caps) {
        simplify_cap(contour.positions_world, cap, level_set.spacing());
        bytes += cap.capacity() * sizeof(cap[0]);
    }
    bytes += sizeof(*this) + level_set.bytes() + contour.keys.capacity() * sizeof(VolumeVertexKey) +
             contour.positions_world.capacity() * sizeof(WorldPos) +
             contour.triangles.capacity() * sizeof(contour.triangles[0]) +
             errors.boxes.capacity() * sizeof(SolidErrorBox) +
             errors.box_of.capacity() * sizeof(std::uint32_t) + contour.surfaces.capacity() +
             contour.replaced.capacity() * sizeof(std::uint16_t);
}

std::size_t bytes_of(const ChunkTiles& tiles) {
    std::size_t bytes = 0;
    for (const auto& tile : tiles) bytes += tile ? tile->bytes : 0;
    return bytes;
}

}  // namespace terrane::internal
