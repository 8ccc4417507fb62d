// SPDX-License-Identifier: MIT
#include "paging/chunk_tiles.h"

#include <algorithm>
#include <map>
#include <utility>

namespace terrane::internal {
namespace {

/// The triangles of a chunk: those of its tiles, each vertex once; parts of the heightfield first.
class ChunkTriangles {
public:
    void add(const TileSolid& tile, int tile_column, int tile_row) {
        const VolumeContour& contour = tile.contour;
        const auto first_box = static_cast<std::uint32_t>(chunk_.error_boxes.size());
        for (const SolidErrorBox& box : tile.errors.boxes) {
            chunk_.error_boxes.push_back(box);
            chunk_.error_m = std::max(chunk_.error_m, box.error_m);
        }
        in_chunk_.assign(contour.keys.size(), kNone);
        const auto corners = [&](const std::array<std::uint32_t, 3>& triangle) {
            // one after the other, so that every compiler makes the vertices in the same order
            const std::uint32_t a = vertex(contour, triangle[0]);
            const std::uint32_t b = vertex(contour, triangle[1]);
            const std::uint32_t c = vertex(contour, triangle[2]);
            return std::array<std::uint32_t, 3>{a, b, c};
        };
        for (std::size_t i = 0; i < contour.triangles.size(); ++i) {
            const bool is_ground = contour.surfaces[i] == SolidPart::ground;
            (is_ground ? chunk_.triangles : walls_).push_back(corners(contour.triangles[i]));
            (is_ground ? chunk_.parts : wall_parts_).push_back(contour.surfaces[i]);
            (is_ground ? chunk_.error_box_of : wall_boxes_)
                .push_back(first_box + tile.errors.box_of[i]);
        }
        for (std::size_t side = 0; side < 4; ++side) {
            for (const auto& triangle : contour.caps[side]) {
                chunk_.caps[side].push_back(corners(triangle));
            }
        }
        for (const std::uint16_t replaced : contour.replaced) {
            const int cell = replaced / 2;
            const std::size_t of_chunk =
                cell_index(tile_column * kVolumeTileCells + cell % kVolumeTileCells,
                           tile_row * kVolumeTileCells + cell / kVolumeTileCells);
            chunk_.replaced.push_back(static_cast<std::uint16_t>(2 * of_chunk + replaced % 2));
        }
    }
    /// All triangles.
    SolidTriangles take() {
        chunk_.ground_count = chunk_.triangles.size();
        chunk_.triangles.insert(chunk_.triangles.end(), walls_.begin(), walls_.end());
        chunk_.parts.insert(chunk_.parts.end(), wall_parts_.begin(), wall_parts_.end());
        chunk_.error_box_of.insert(chunk_.error_box_of.end(), wall_boxes_.begin(),
                                   wall_boxes_.end());
        return std::move(chunk_);
    }
    SolidTriangles* operator->() { return &chunk_; }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    // Only vertices on the lines between tiles are in more than one of them. Vertices that no triangle uses, as inside
    // simplified caps, are left out.
    std::uint32_t vertex(const VolumeContour& contour, std::uint32_t i) {
        std::uint32_t& known = in_chunk_[i];
        if (known != kNone) return known;
        const VolumeVertexKey& key = contour.keys[i];
        const auto is_on_line = [](std::int64_t a, std::int64_t b) {
            return a == b && a % kVolumeTileCells == 0;
        };
        const auto next = static_cast<std::uint32_t>(chunk_.vertices_world.size());
        if (is_on_line(key.first.column, key.second.column) ||
            is_on_line(key.first.row, key.second.row)) {
            const auto [found, is_new] = on_lines_.try_emplace(key, next);
            if (!is_new) return known = found->second;
        }
        chunk_.vertices_world.push_back(contour.positions_world[i]);
        return known = next;
    }

    SolidTriangles chunk_;
    std::vector<std::array<std::uint32_t, 3>> walls_;
    std::vector<SolidPart> wall_parts_;
    std::vector<std::uint32_t> wall_boxes_;
    std::vector<std::uint32_t> in_chunk_;  // of the tile's vertices
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

std::shared_ptr<const SolidSurface> make_solid(const Lattice& lattice, const Chunk& chunk,
                                               const ChunkTiles& tiles, SolidLevels levels) {
    ChunkTriangles made;
    std::size_t vertex_count = 0, triangle_count = 0, replaced_count = 0;
    for (const auto& tile : tiles) {
        vertex_count += tile ? tile->contour.keys.size() : 0;
        triangle_count += tile ? tile->contour.triangles.size() : 0;
        replaced_count += tile ? tile->contour.replaced.size() : 0;
    }
    made->vertices_world.reserve(vertex_count + replaced_count + 64);  // with kept neighbours
    made->triangles.reserve(triangle_count);
    made->parts.reserve(triangle_count);
    made->error_box_of.reserve(triangle_count);
    made->replaced.reserve(replaced_count);
    for (int i = 0; i < kChunkTiles; ++i) {
        const auto& tile = tiles[static_cast<std::size_t>(i)];
        if (!tile) continue;
        made->hidden_error_m = std::max(made->hidden_error_m, tile->farthest_from_ground_m);
        made.add(*tile, i % kTilesPerChunk, i / kTilesPerChunk);
    }
    SolidTriangles triangles = made.take();
    if (triangles.triangles.empty() && triangles.replaced.empty()) return nullptr;
    if (levels == SolidLevels::all) add_levels(lattice, chunk, triangles);
    add_kept_neighbours(lattice, chunk, triangles);
    return std::make_shared<const SolidSurface>(std::move(triangles));
}

}  // namespace terrane::internal
