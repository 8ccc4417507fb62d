// SPDX-License-Identifier: MIT
#include "paging/solid_extents.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kTilesPerChunk = kChunkCells / kVolumeTileCells;

std::int32_t floor_divide(std::int64_t a, std::int64_t b) {
    return static_cast<std::int32_t>(a / b - (a % b < 0 ? 1 : 0));
}

/// The rectangle of a tile, widened by a cell.
WorldRect rect_of(const Volumes& volumes, const VolumeTileKey& key) {
    const Lattice& lattice = volumes.lattice();
    const std::int64_t step = lattice.step(volumes.level());
    const std::int64_t west = key.column * kVolumeTileCells, south = key.row * kVolumeTileCells;
    return {lattice.x((west - 1) * step), lattice.y((south - 1) * step),
            lattice.x((west + kVolumeTileCells + 1) * step),
            lattice.y((south + kVolumeTileCells + 1) * step)};
}

/// What one operation adds to the heightfield over a tile; none if nothing.
std::optional<SolidExtent> extent_of(VolumeOp op, const HeightInterval& shape,
                                     const HeightInterval& ground, double spacing) {
    // The contour cuts off or overshoots by less than the longest edge of its lattice over flat ground.
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

SolidExtents::SolidExtents(const HeightSource& heights, const Volumes& volumes)
    : lattice_(volumes.lattice()) {
    for (const VolumeTileKey& tile : volumes.tiles()) {
        const HeightInterval ground = heights.interval(rect_of(volumes, tile));
        std::optional<Extent> all;
        const auto indices = volumes.operations_at(tile);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            const VolumeTilePart& part = volumes.parts_at(tile)[i];
            const auto solid = extent_of(volumes.operations()[indices[i]].op(), part.heights,
                                         ground, volumes.spacing());
            if (!solid) continue;
            if (!all) all = Extent{*solid, 0.0};
            all->solid.error_m = std::max(all->solid.error_m, solid->error_m);
            all->solid.heights = {std::min(all->solid.heights.low, solid->heights.low),
                                  std::max(all->solid.heights.high, solid->heights.high)};
            all->area += part.area;
        }
        if (!all) continue;
        include({floor_divide(tile.column, kTilesPerChunk), floor_divide(tile.row, kTilesPerChunk),
                 static_cast<std::uint8_t>(volumes.level())},
                *all);
    }
}

// In the chunk and all above it.
void SolidExtents::include(const ChunkKey& key, const Extent& extent) {
    for (ChunkKey at = key;; at = at.parent()) {
        const auto [found, is_new] = chunks_.try_emplace(at, extent);
        if (!is_new) {
            Extent& all = found->second;
            all.solid.error_m = std::max(all.solid.error_m, extent.solid.error_m);
            all.solid.heights = {std::min(all.solid.heights.low, extent.solid.heights.low),
                                 std::max(all.solid.heights.high, extent.solid.heights.high)};
            all.area += extent.area;
        }
        if (at.level == 0) return;
    }
}

std::optional<SolidExtent> SolidExtents::of_chunk(const ChunkKey& key) const {
    const auto found = chunks_.find(key);
    if (found == chunks_.end()) return std::nullopt;
    return found->second.solid;
}

std::optional<HeightInterval> SolidExtents::over(const WorldRect& rect) const {
    if (!(rect.west <= rect.east && rect.south <= rect.north)) return std::nullopt;
    // The finest level at which the rectangle touches at most two columns and rows.
    const double width = std::max(rect.east - rect.west, rect.north - rect.south);
    int level = lattice_.finest_level;
    while (level > 0 && lattice_.level_spacing(level) * kChunkCells < width) --level;
    const double side = lattice_.level_spacing(level) * kChunkCells;
    const auto index = [&](double p, double origin) {
        constexpr double kMost = 0x1p30;
        return static_cast<std::int32_t>(
            std::clamp(std::floor((p - origin) / side), -kMost, kMost));
    };
    std::optional<HeightInterval> heights;
    const std::int32_t east = index(rect.east, lattice_.origin_x);
    const std::int32_t north = index(rect.north, lattice_.origin_y);
    const std::int32_t per_root = 1 << level;
    const std::int32_t first_x = lattice_.first_root_x * per_root;
    const std::int32_t first_y = lattice_.first_root_y * per_root;
    const std::int32_t last_x = first_x + lattice_.root_count_x * per_root - 1;
    const std::int32_t last_y = first_y + lattice_.root_count_y * per_root - 1;
    for (std::int32_t y = std::max(index(rect.south, lattice_.origin_y), first_y);
         y <= std::min(north, last_y); ++y) {
        for (std::int32_t x = std::max(index(rect.west, lattice_.origin_x), first_x);
             x <= std::min(east, last_x); ++x) {
            const auto found = chunks_.find({x, y, static_cast<std::uint8_t>(level)});
            if (found == chunks_.end()) continue;
            const HeightInterval& own = found->second.solid.heights;
            heights = heights ? HeightInterval{std::min(heights->low, own.low),
                                               std::max(heights->high, own.high)}
                              : own;
        }
    }
    return heights;
}

double SolidExtents::area(const ChunkKey& key) const {
    const auto found = chunks_.find(key);
    return found == chunks_.end() ? 0.0 : found->second.area;
}

std::size_t SolidSizes::of(const ChunkKey& key) const {
    const std::scoped_lock lock(mutex_);
    const auto found = bytes_.find(key);
    return found == bytes_.end() ? 0 : found->second;
}

void SolidSizes::record(const ChunkKey& key, std::size_t bytes) {
    const std::scoped_lock lock(mutex_);
    bytes_[key] = bytes;
}

}  // namespace terrane::internal
