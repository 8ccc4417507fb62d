// SPDX-License-Identifier: MIT
#include "paging/chunk_tiles.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// The longest edge that a surface passes through, metres. Two corners of a tetrahedron on the same side of the surface
/// are both joined to one on the other side by such edges, so that twice their length bounds its diameter.
double longest_edge(const VolumeTile& tile, const VolumeContour& contour) {
    const auto place = [&](const VolumeNode& node) {
        return tile.position(static_cast<int>(node.column - contour.key.column * kVolumeTileCells),
                             static_cast<int>(node.row - contour.key.row * kVolumeTileCells),
                             node.k);
    };
    double longest = 0.0;
    for (const VolumeVertexKey& key : contour.keys) {
        if (!key.is_sample()) {
            longest = std::max(longest, (place(key.second) - place(key.first)).norm());
        }
    }
    return longest;
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

TileSolid::TileSolid(VolumeTile tile)
    : level_set(std::move(tile)),
      contour(level_set.contour()),
      longest_edge_m(longest_edge(level_set, contour)),
      farthest_from_ground_m(farthest_from_ground(level_set, contour)) {
    bytes = sizeof(*this) + level_set.bytes() + contour.keys.capacity() * sizeof(VolumeVertexKey) +
            contour.positions_world.capacity() * sizeof(WorldPos) +
            contour.triangles.capacity() * sizeof(contour.triangles[0]) +
            contour.surfaces.capacity() + contour.replaced.capacity() * sizeof(std::uint16_t);
}

std::size_t bytes_of(const ChunkTiles& tiles) {
    std::size_t bytes = 0;
    for (const auto& tile : tiles) bytes += tile ? tile->bytes : 0;
    return bytes;
}

}  // namespace terrane::internal
