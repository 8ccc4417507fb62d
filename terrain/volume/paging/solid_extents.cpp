// SPDX-License-Identifier: MIT
#include "paging/solid_extents.h"

#include "paging/chunk_tiles.h"

#include <algorithm>
#include <cmath>
#include <map>

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

/// What one operation adds to the heightfield over a tile; none if nothing.
std::optional<SolidExtent> solid_of(VolumeOp op, const HeightInterval& shape,
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
    // Of more squares than chunks with a surface, as in a world of many root squares, the chunks are looked through.
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
