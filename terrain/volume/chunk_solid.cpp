// SPDX-License-Identifier: MIT
#include <terrane/volume/chunk_solid.h>
#include <terrane/volume/volume_tile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace terrane {
namespace {

constexpr int kTilesPerChunk = kChunkCells / kVolumeTileCells;

/// The samples of a tile of a chunk, row by row.
std::vector<std::int32_t> copy_heights(const Chunk& chunk, int tile_column, int tile_row) {
    std::vector<std::int32_t> heights;
    heights.reserve(static_cast<std::size_t>(kVolumeTileSamples) * kVolumeTileSamples);
    for (int row = 0; row < kVolumeTileSamples; ++row) {
        const auto first = chunk.heights.begin() +
                           static_cast<std::ptrdiff_t>(sample_index(
                               tile_column * kVolumeTileCells, tile_row * kVolumeTileCells + row));
        heights.insert(heights.end(), first, first + kVolumeTileSamples);
    }
    return heights;
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

/// The triangles of a chunk: those of its tiles, each vertex once.
class ChunkTriangles {
public:
    void add(VolumeContour&& contour, int tile_column, int tile_row) {
        std::vector<std::uint32_t> in_chunk(contour.keys.size());
        for (std::size_t i = 0; i < contour.keys.size(); ++i) {
            in_chunk[i] = vertex(contour, i);
        }
        for (const std::array<std::uint32_t, 3>& triangle : contour.triangles) {
            chunk_.triangles.push_back(
                {in_chunk[triangle[0]], in_chunk[triangle[1]], in_chunk[triangle[2]]});
        }
        for (std::size_t side = 0; side < 4; ++side) {
            for (const std::array<std::uint32_t, 3>& triangle : contour.caps[side]) {
                chunk_.caps[side].push_back(
                    {in_chunk[triangle[0]], in_chunk[triangle[1]], in_chunk[triangle[2]]});
            }
        }
        chunk_.parts.insert(chunk_.parts.end(), contour.surfaces.begin(), contour.surfaces.end());
        for (const std::uint16_t replaced : contour.replaced) {
            const int cell = replaced / 2;
            const std::size_t of_chunk =
                cell_index(tile_column * kVolumeTileCells + cell % kVolumeTileCells,
                           tile_row * kVolumeTileCells + cell / kVolumeTileCells);
            chunk_.replaced.push_back(static_cast<std::uint16_t>(2 * of_chunk + replaced % 2));
        }
    }
    /// Puts the parts of the heightfield first, otherwise in the order of add().
    void sort_parts() {
        const std::vector<SolidPart> parts = std::move(chunk_.parts);
        const auto triangles = std::move(chunk_.triangles);
        chunk_.parts.clear();
        chunk_.triangles.clear();
        for (const bool is_ground : {true, false}) {
            for (std::size_t i = 0; i < triangles.size(); ++i) {
                if ((parts[i] == SolidPart::ground) != is_ground) continue;
                chunk_.triangles.push_back(triangles[i]);
                chunk_.parts.push_back(parts[i]);
            }
            if (is_ground) chunk_.ground_count = chunk_.triangles.size();
        }
    }
    SolidTriangles& operator*() { return chunk_; }
    SolidTriangles* operator->() { return &chunk_; }

private:
    // Only vertices on the lines between tiles are in more than one of them.
    std::uint32_t vertex(const VolumeContour& contour, std::size_t i) {
        const VolumeVertexKey& key = contour.keys[i];
        const auto is_on_line = [](std::int64_t a, std::int64_t b) {
            return a == b && a % kVolumeTileCells == 0;
        };
        const auto next = static_cast<std::uint32_t>(chunk_.vertices_world.size());
        if (is_on_line(key.first.column, key.second.column) ||
            is_on_line(key.first.row, key.second.row)) {
            const auto [found, is_new] = on_lines_.try_emplace(key, next);
            if (!is_new) return found->second;
        }
        chunk_.vertices_world.push_back(contour.positions_world[i]);
        return next;
    }

    SolidTriangles chunk_;
    std::map<VolumeVertexKey, std::uint32_t> on_lines_;
};

/// Adds the triangles of the heightfield around the replaced ones.
void add_kept_neighbours(const Lattice& lattice, const Chunk& chunk, SolidTriangles& solid) {
    constexpr std::size_t kTriangles = std::size_t{2} * kChunkCells * kChunkCells;
    std::vector<std::uint8_t> is_replaced(kTriangles), is_near(kTriangles);
    for (const std::uint16_t replaced : solid.replaced) {
        is_replaced[replaced] = 1;
        const int column = replaced / 2 % kChunkCells, row = replaced / 2 / kChunkCells;
        for (int y = std::max(row - 1, 0); y <= std::min(row + 1, kChunkCells - 1); ++y) {
            for (int x = std::max(column - 1, 0); x <= std::min(column + 1, kChunkCells - 1); ++x) {
                is_near[2 * cell_index(x, y)] = is_near[2 * cell_index(x, y) + 1] = 1;
            }
        }
    }
    std::map<std::size_t, std::uint32_t> vertices;  // by index of the sample
    const auto vertex = [&](int column, int row) {
        const std::size_t sample = sample_index(column, row);
        const auto [found, is_new] =
            vertices.try_emplace(sample, static_cast<std::uint32_t>(solid.vertices_world.size()));
        if (is_new) {
            // The bits of the contour's vertices at samples.
            solid.vertices_world.emplace_back(
                lattice.x(chunk.corner.x + column * chunk.step),
                lattice.y(chunk.corner.y + row * chunk.step),
                static_cast<double>(chunk.heights[sample]) * lattice.quantum);
        }
        return found->second;
    };
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = 0; column < kChunkCells; ++column) {
            if ((chunk.flags_at(column, row) & cell_outside) != 0) continue;
            const bool cut = cut_to_north_east(column, row);  // as of the lattice: chunks are even
            for (const bool is_north : {false, true}) {
                const std::size_t triangle = 2 * cell_index(column, row) + (is_north ? 1 : 0);
                if (is_near[triangle] == 0 || is_replaced[triangle] != 0) continue;
                const int base = is_north ? row + 1 : row;
                const int west = is_north ? column + 1 : column,
                          east = is_north ? column : column + 1;
                // The horizontal edge, then the corner on the other side of the cell.
                const int apex = cut == is_north ? column : column + 1;
                const std::uint32_t a = vertex(west, base), b = vertex(east, base);
                const std::uint32_t c = vertex(apex, is_north ? row : row + 1);
                solid.kept_neighbours.push_back({a, b, c});
            }
        }
    }
}

}  // namespace

Result<std::shared_ptr<const SolidSurface>> make_chunk_solid(const Volumes& volumes,
                                                             const Chunk& chunk) {
    if (chunk.key.level != volumes.level()) {
        return tl::unexpected(Error{ErrorCode::invalid_argument,
                                    "a chunk of level " + std::to_string(chunk.key.level) +
                                        " has no volumes: the pinned level is " +
                                        std::to_string(volumes.level())});
    }
    ChunkTriangles triangles;
    for (int row = 0; row < kTilesPerChunk; ++row) {
        for (int column = 0; column < kTilesPerChunk; ++column) {
            const VolumeTileKey key{std::int64_t{chunk.key.x} * kTilesPerChunk + column,
                                    std::int64_t{chunk.key.y} * kTilesPerChunk + row};
            if (volumes.operations_at(key).empty()) continue;
            Result<VolumeTile> tile =
                VolumeTile::create(volumes, key, copy_heights(chunk, column, row));
            if (!tile) return tl::unexpected(tile.error());
            const int last = kTilesPerChunk - 1;
            VolumeContour contour =
                tile->contour({column == 0, column == last, row == 0, row == last});
            triangles->error_m = std::max(triangles->error_m, contour.error_m);
            triangles->hidden_error_m =
                std::max(triangles->hidden_error_m, farthest_from_ground(*tile, contour));
            triangles.add(std::move(contour), column, row);
        }
    }
    if (triangles->triangles.empty() && triangles->replaced.empty()) return nullptr;
    triangles.sort_parts();
    add_kept_neighbours(volumes.lattice(), chunk, *triangles);
    return std::make_shared<const SolidSurface>(std::move(*triangles));
}

}  // namespace terrane
