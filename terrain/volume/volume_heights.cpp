// SPDX-License-Identifier: MIT
#include "edit/edited_volumes.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/number_text.h>
#include <terrane/volume/volume_heights.h>

#include <algorithm>
#include <utility>

namespace terrane {
Result<std::shared_ptr<VolumeHeights>> VolumeHeights::create(
    std::shared_ptr<const HeightSource> heights, const Volumes& volumes) {
    if (!heights) return fail(ErrorCode::invalid_argument, "volumes need a heightfield");
    if (!(heights->lattice() == volumes.lattice())) {
        return fail(ErrorCode::invalid_argument,
                    "the volumes were placed for another lattice than the heightfield's");
    }
    if (const int finest = heights->lattice().finest_level; volumes.level() != finest) {
        return fail(ErrorCode::invalid_argument, "volumes must be placed for the finest level, " +
                                                     number_text(finest) + ", got " +
                                                     number_text(volumes.level()));
    }
    return std::shared_ptr<VolumeHeights>(new VolumeHeights(std::move(heights), volumes));
}

VolumeHeights::VolumeHeights(std::shared_ptr<const HeightSource> heights, const Volumes& volumes)
    : HeightSource(heights->lattice(), heights->extent()),
      heights_(std::move(heights)),
      volumes_(volumes),
      edited_(std::make_unique<internal::EditedVolumes>(*heights_, volumes_)) {}

VolumeHeights::~VolumeHeights() = default;

double VolumeHeights::height(double x, double y) const { return heights_->height(x, y); }

Result<void> VolumeHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    return heights_->sample(grid, heights_out);
}

Result<void> VolumeHeights::vertex_bounds(const SampleGrid& grid,
                                          std::span<float> bounds_out) const {
    return heights_->vertex_bounds(grid, bounds_out);
}

Result<void> VolumeHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    return heights_->cell_bounds(grid, bounds_out);
}

Result<void> VolumeHeights::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                        std::span<float> cell_bounds_out) const {
    return heights_->mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
}

Result<void> VolumeHeights::cell_flags(const SampleGrid& grid,
                                       std::span<std::uint8_t> flags_out) const {
    return heights_->cell_flags(grid, flags_out);
}

HeightInterval VolumeHeights::interval(const WorldRect& rect) const {
    HeightInterval heights = heights_->interval(rect);
    if (const auto solids = edited_->over(rect)) {
        heights = {std::min(heights.low, solids->low), std::max(heights.high, solids->high)};
    }
    return heights;
}

double VolumeHeights::rise_bound(double distance) const { return heights_->rise_bound(distance); }

Result<std::shared_ptr<const Chunk>> VolumeHeights::stored_chunk(
    const ChunkKey& key, const std::stop_token& stop) const {
    if (key.level != volumes_.level() || !edited_->is_touched(key)) {
        return heights_->stored_chunk(key, stop);
    }
    auto made = make_chunk(*heights_, key, stop);
    if (!made) return made;
    return edited_->make(std::move(*made));
}

std::optional<SolidExtent> VolumeHeights::solid_extent(const ChunkKey& key) const {
    const auto extent = edited_->extent_of(key);
    if (!extent) return std::nullopt;
    return extent->solid;
}

std::size_t VolumeHeights::max_chunk_bytes(const ChunkKey& key) const {
    const std::size_t plain = heights_->max_chunk_bytes(key);
    return key.level == volumes_.level() ? edited_->max_bytes(key, plain) : plain;
}

bool VolumeHeights::is_current(const Chunk& chunk) const {
    return chunk.key.level != volumes_.level() || edited_->is_current(chunk);
}

}  // namespace terrane
