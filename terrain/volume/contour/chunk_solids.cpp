// SPDX-License-Identifier: MIT
#include "contour/chunk_solids.h"

#include <terrane/base/result.h>
#include <terrane/terrain/simplify.h>
#include <terrane/volume/volume_tile.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace terrane::internal {
namespace {

/// Whether each side of a tile is a side of its chunk: west, east, south, north.
std::array<bool, 4> sides_of_chunk(const VolumeTileKey& key) {
    const auto place = [](std::int64_t i) {
        return (i % kTilesPerChunk + kTilesPerChunk) % kTilesPerChunk;
    };
    return {place(key.column) == 0, place(key.column) == kTilesPerChunk - 1, place(key.row) == 0,
            place(key.row) == kTilesPerChunk - 1};
}

/// Largest vertical distance of a contour's vertices from the heightfield, metres. Each triangle of the contour is
/// above or below one triangle of the heightfield: the distance is linear over it, so no point of the contour is
/// farther. No replaced point of the heightfield is farther either: each is above or below a point of the contour.
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

namespace {

/// Merges the triangles of a chunk's tiles. Makes each vertex once, and puts remainders of the heightfield first.
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
            // In sequence, so that every compiler makes the vertices in the same order.
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

    // Only vertices on the lines between tiles are shared. Vertices that no triangle uses, such as inside simplified
    // caps, are left out.
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
    std::vector<std::uint32_t> in_chunk_;  // index in the chunk of each of the tile's vertices
    std::map<VolumeVertexKey, std::uint32_t> on_lines_;
};

/// Adds the neighbours of the replaced triangles of the heightfield.
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
    std::map<std::size_t, std::uint32_t> vertices;  // by sample index
    const auto vertex = [&](int column, int row) {
        const std::size_t sample = sample_index(column, row);
        const auto [found, is_new] =
            vertices.try_emplace(sample, static_cast<std::uint32_t>(solid.vertices_world.size()));
        if (is_new) {
            // The same bits as the contour's vertices at samples.
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
            const bool cut = cut_to_north_east(column, row);  // chunks start at even addresses
            for (const bool is_north : {false, true}) {
                const std::size_t triangle = 2 * cell_index(column, row) + (is_north ? 1 : 0);
                if (is_near[triangle] == 0 || is_replaced[triangle] != 0) continue;
                const int base = is_north ? row + 1 : row;
                const int west = is_north ? column + 1 : column,
                          east = is_north ? column : column + 1;
                // The horizontal edge, then the third corner.
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
    made->vertices_world.reserve(vertex_count + replaced_count + 64);  // includes the neighbours
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

// Levels of detail of a chunk's triangles, and simplified caps, by half-edge contraction (terrain/mesh).

namespace {

using TriangleIndices = std::array<std::uint32_t, 3>;

/// Errors of the levels, spacings. A level is skipped unless it has at least a quarter fewer triangles than the
/// previous one.
constexpr std::array kLevelErrors{0.02, 0.06, 0.2, 0.6, 1.8, 5.4};
constexpr double kLeastGain = 0.75;
/// Error of a cap, spacings: it is planar up to rounding.
constexpr double kCapError = 1e-3;

/// Locks the vertices of edges without exactly two triangles.
void lock_border(std::span<const TriangleIndices> triangles, std::vector<std::uint8_t>& locked) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(3 * triangles.size());
    for (const auto& [a, b, c] : triangles) {
        for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
            edges.emplace_back(std::min(from, to), std::max(from, to));
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end - i != 2) locked[edges[i].first] = locked[edges[i].second] = 1;
        i = end;
    }
}

}  // namespace

void add_levels(const Lattice& lattice, const Chunk& chunk, SolidTriangles& solid) {
    const std::span<const TriangleIndices> all(solid.triangles);
    const auto ground = all.first(solid.ground_count), walls = all.subspan(solid.ground_count);
    if (walls.empty()) return;
    std::vector<std::uint8_t> locked(solid.vertices_world.size(), 0);
    lock_border(walls, locked);
    for (const TriangleIndices& triangle : ground) {
        for (const std::uint32_t corner : triangle) locked[corner] = 1;
    }
    // Also locks vertices on the sides of the chunk, because a wall may lie in a side.
    const std::int64_t side = kChunkCells * chunk.step;
    const double west = lattice.x(chunk.corner.x), east = lattice.x(chunk.corner.x + side);
    const double south = lattice.y(chunk.corner.y), north = lattice.y(chunk.corner.y + side);
    for (std::size_t i = 0; i < locked.size(); ++i) {
        const Eigen::Vector3d& p = solid.vertices_world[i];
        if (p.x() == west || p.x() == east || p.y() == south || p.y() == north) locked[i] = 1;
    }
    const double spacing = lattice.level_spacing(chunk.key.level);
    std::vector<SimplifyLevel> levels;
    for (const double error : kLevelErrors) levels.push_back({.error_m = error * spacing});
    auto made = simplify({solid.vertices_world, walls, locked, false}, levels);
    TERRANE_ASSERT(made.has_value(), "contours are valid meshes");
    if (!made) return;
    std::size_t least = walls.size();
    for (SimplifiedMesh& mesh : *made) {
        if (static_cast<double>(mesh.triangles.size()) > kLeastGain * static_cast<double>(least))
            continue;
        least = mesh.triangles.size();
        SolidLevel& level = solid.levels.emplace_back();
        level.error_m = mesh.error_m;
        level.triangles.reserve(ground.size() + mesh.triangles.size());
        level.triangles.assign(ground.begin(), ground.end());
        level.triangles.insert(level.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
    }
}

void simplify_cap(std::span<const WorldPos> vertices, std::vector<TriangleIndices>& cap,
                  double spacing) {
    if (cap.empty()) return;
    std::vector<std::uint8_t> locked(vertices.size(), 0);
    lock_border(cap, locked);
    const SimplifyLevel level{.error_m = kCapError * spacing};
    auto made = simplify({vertices, cap, locked}, {&level, 1});
    TERRANE_ASSERT(made.has_value(), "caps are valid meshes");
    if (made) cap = std::move(made->front().triangles);
}

}  // namespace terrane::internal

namespace terrane {

Result<std::shared_ptr<const SolidSurface>> make_chunk_solid(const Volumes& volumes,
                                                             const Chunk& chunk) {
    if (chunk.key.level != volumes.level()) {
        return tl::unexpected(Error{ErrorCode::invalid_argument,
                                    "a chunk of level " + std::to_string(chunk.key.level) +
                                        " has no volumes: the pinned level is " +
                                        std::to_string(volumes.level())});
    }
    internal::ChunkTiles tiles;
    for (int i = 0; i < internal::kChunkTiles; ++i) {
        const VolumeTileKey key = internal::tile_of(chunk.key, i);
        if (volumes.operations_at(key).empty()) continue;
        TERRANE_TRY(VolumeTile tile,
                    VolumeTile::create(volumes, key, internal::tile_heights(chunk, i)));
        tiles[static_cast<std::size_t>(i)] = std::make_shared<const internal::TileSolid>(
            std::move(tile), internal::operations_of(volumes, key));
    }
    return internal::make_solid(volumes.lattice(), chunk, tiles, internal::SolidLevels::all);
}

}  // namespace terrane

namespace terrane::internal {
namespace {

/// The rectangle of a tile, widened by a cell.
WorldRect rect_of(const Volumes& volumes, const VolumeTileKey& key) {
    const Lattice& lattice = volumes.lattice();
    const std::int64_t step = lattice.step(volumes.level());
    const std::int64_t west = key.column * kVolumeTileCells, south = key.row * kVolumeTileCells;
    return {lattice.x((west - 1) * step), lattice.y((south - 1) * step),
            lattice.x((west + kVolumeTileCells + 1) * step),
            lattice.y((south + kVolumeTileCells + 1) * step)};
}

/// Extent of one operation over a tile; absent if it changes nothing there.
std::optional<SolidExtent> solid_of(VolumeOp op, const HeightInterval& shape,
                                    const HeightInterval& ground, double spacing) {
    // Over flat ground, the contour deviates from the shape by less than the longest edge of its lattice.
    const double margin = 2.0 * spacing;
    HeightInterval part{shape.low - margin, shape.high + margin};
    if (op == VolumeOp::remove) {
        part.high = std::min(part.high, ground.high);
        if (!(part.low <= part.high)) return std::nullopt;
        return SolidExtent{ground.high - part.low, part};
    }
    part.low = std::max(part.low, ground.low);
    if (!(part.low <= part.high)) return std::nullopt;
    return SolidExtent{part.high - ground.low, part};
}

}  // namespace

std::optional<ChunkExtent> united(const std::optional<ChunkExtent>& a,
                                  const std::optional<ChunkExtent>& b) {
    if (!a || !b) return a ? a : b;
    return ChunkExtent{{std::max(a->solid.error_m, b->solid.error_m),
                        {std::min(a->solid.heights.low, b->solid.heights.low),
                         std::max(a->solid.heights.high, b->solid.heights.high)}},
                       a->area + b->area};
}

std::optional<ChunkExtent> extent_of(const HeightSource& heights, const Volumes& volumes,
                                     VolumeOp op, const VolumeTilePart& part) {
    const auto solid =
        solid_of(op, part.heights, heights.interval(rect_of(volumes, part.key)), volumes.spacing());
    if (!solid) return std::nullopt;
    return ChunkExtent{*solid, part.area};
}

SolidExtents::SolidExtents(const HeightSource& heights, const Volumes& volumes)
    : lattice_(volumes.lattice()) {
    std::map<ChunkKey, std::optional<ChunkExtent>> extents;
    for (const VolumeTileKey& tile : volumes.tiles()) {
        std::optional<ChunkExtent>& all = extents[chunk_of(tile, volumes.level())];
        const auto indices = volumes.operations_at(tile);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            all = united(all, extent_of(heights, volumes, volumes.operations()[indices[i]].op(),
                                        volumes.parts_at(tile)[i]));
        }
    }
    for (const auto& [key, extent] : extents) set(key, extent);
}

void SolidExtents::set(const ChunkKey& key, const std::optional<ChunkExtent>& extent) {
    std::optional<ChunkExtent> changed = extent;
    for (ChunkKey at = key;;) {
        if (of_chunk(at) == changed) return;
        if (changed) {
            chunks_.insert_or_assign(at, *changed);
        } else {
            chunks_.erase(at);
        }
        if (at.level == 0) return;
        at = at.parent();
        changed.reset();
        for (int quadrant = 0; quadrant < 4; ++quadrant)
            changed = united(changed, of_chunk(at.child(quadrant)));
    }
}

std::optional<ChunkExtent> SolidExtents::of_chunk(const ChunkKey& key) const {
    const auto found = chunks_.find(key);
    if (found == chunks_.end()) return std::nullopt;
    return found->second;
}

std::optional<HeightInterval> SolidExtents::over(const WorldRect& rect) const {
    if (!(rect.west <= rect.east && rect.south <= rect.north)) return std::nullopt;
    // The finest level at which the rectangle touches at most two columns and two rows of chunks.
    const double width = std::max(rect.east - rect.west, rect.north - rect.south);
    int level = lattice_.finest_level;
    while (level > 0 && lattice_.level_spacing(level) * kChunkCells < width) --level;
    const double side = lattice_.level_spacing(level) * kChunkCells;
    const auto index = [&](double p, double origin) {
        constexpr double kMost = 0x1p30;
        return static_cast<std::int32_t>(
            std::clamp(std::floor((p - origin) / side), -kMost, kMost));
    };
    const std::int32_t per_root = 1 << level;
    const std::int32_t first_x = lattice_.first_root_x * per_root;
    const std::int32_t first_y = lattice_.first_root_y * per_root;
    const auto last_x = static_cast<std::int32_t>(
        (std::int64_t{lattice_.first_root_x} + lattice_.root_count_x) * per_root - 1);
    const auto last_y = static_cast<std::int32_t>(
        (std::int64_t{lattice_.first_root_y} + lattice_.root_count_y) * per_root - 1);
    const std::int32_t west = std::max(index(rect.west, lattice_.origin_x), first_x);
    const std::int32_t south = std::max(index(rect.south, lattice_.origin_y), first_y);
    const std::int32_t east = std::min(index(rect.east, lattice_.origin_x), last_x);
    const std::int32_t north = std::min(index(rect.north, lattice_.origin_y), last_y);
    if (west > east || south > north) return std::nullopt;
    std::optional<HeightInterval> heights;
    const auto include = [&heights](const HeightInterval& own) {
        heights = heights ? HeightInterval{std::min(heights->low, own.low),
                                           std::max(heights->high, own.high)}
                          : own;
    };
    // In a world of many root squares the rectangle may cover more squares than there are chunks with a surface. Then
    // iterates over these chunks.
    const double squares = (double{1} + east - west) * (double{1} + north - south);
    if (squares > static_cast<double>(chunks_.size())) {
        for (const auto& [key, chunk] : chunks_) {
            if (key.level == level && key.x >= west && key.x <= east && key.y >= south &&
                key.y <= north)
                include(chunk.solid.heights);
        }
        return heights;
    }
    for (std::int32_t y = south; y <= north; ++y) {
        for (std::int32_t x = west; x <= east; ++x) {
            const auto found = chunks_.find({x, y, static_cast<std::uint8_t>(level)});
            if (found != chunks_.end()) include(found->second.solid.heights);
        }
    }
    return heights;
}

}  // namespace terrane::internal
