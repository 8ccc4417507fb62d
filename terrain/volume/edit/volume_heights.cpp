// SPDX-License-Identifier: MIT
#include "edit/edited_volumes.h"

#include <terrane/base/text.h>
#include <terrane/terrain/chunk.h>
#include <terrane/volume/volume_heights.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace terrane {
namespace {

// Distance, in spacings, within which a point counts as inside a volume: exceeds the rounding of samples and of level
// sets.
constexpr double kInsideWithin = 0.25;

}  // namespace

Result<std::shared_ptr<VolumeHeights>> VolumeHeights::create(
    std::shared_ptr<const HeightSource> heights, const Volumes& volumes) {
    if (!heights) return fail(ErrorCode::invalid_argument, "volumes need a heightfield");
    if (!(heights->lattice() == volumes.lattice())) {
        return fail(ErrorCode::invalid_argument,
                    "the volumes were placed for another lattice than the heightfield's");
    }
    if (!heights->is_certified()) {
        return fail(ErrorCode::invalid_argument,
                    "volumes need a heightfield with certified bounds, got one with estimates");
    }
    if (const int finest = heights->lattice().finest_level; volumes.level() != finest) {
        return fail(ErrorCode::invalid_argument, "volumes must be placed for the finest level, " +
                                                     number_text(finest) + ", got " +
                                                     number_text(volumes.level()));
    }
    return std::shared_ptr<VolumeHeights>(new VolumeHeights(std::move(heights), volumes));
}

VolumeHeights::VolumeHeights(std::shared_ptr<const HeightSource> heights, const Volumes& volumes)
    : ForwardedHeights(std::move(heights)),
      volumes_(volumes),
      edited_(std::make_unique<internal::EditedVolumes>(this->heights(), volumes_)) {}

VolumeHeights::~VolumeHeights() = default;

HeightInterval VolumeHeights::interval(const WorldRect& rect) const {
    HeightInterval all = heights().interval(rect);
    if (const auto solids = edited_->over(rect)) {
        all = {std::min(all.low, solids->low), std::max(all.high, solids->high)};
    }
    return all;
}

Result<std::shared_ptr<const Chunk>> VolumeHeights::stored_chunk(
    const ChunkKey& key, const std::stop_token& stop) const {
    if (key.level != volumes_.level() || !edited_->is_touched(key)) {
        return ForwardedHeights::stored_chunk(key, stop);
    }
    TERRANE_TRY(auto made, make_chunk(heights(), key, stop));
    return edited_->make(std::move(made));
}

std::optional<SolidExtent> VolumeHeights::solid_extent(const ChunkKey& key) const {
    const auto extent = edited_->extent_of(key);
    if (!extent) return std::nullopt;
    return extent->solid;
}

bool VolumeHeights::is_in_volume(double x, double y, double z) const {
    const double side = kVolumeTileCells * volumes_.spacing();
    const VolumeTileKey tile = {
        static_cast<std::int64_t>(std::floor((x - lattice().origin_x) / side)),
        static_cast<std::int64_t>(std::floor((y - lattice().origin_y) / side))};
    const std::span<const std::uint32_t> near = volumes_.operations_at(tile);
    return std::any_of(near.begin(), near.end(), [&](std::uint32_t index) {
        return volumes_.operations()[index].signed_distance({x, y, z}) <
               kInsideWithin * volumes_.spacing();
    });
}

std::size_t VolumeHeights::max_chunk_bytes(const ChunkKey& key) const {
    const std::size_t plain = ForwardedHeights::max_chunk_bytes(key);
    return key.level == volumes_.level() ? edited_->max_bytes(key, plain) : plain;
}

bool VolumeHeights::is_current(const Chunk& chunk) const {
    return chunk.key.level != volumes_.level() || edited_->is_current(chunk);
}

}  // namespace terrane
