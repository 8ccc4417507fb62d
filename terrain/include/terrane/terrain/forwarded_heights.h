// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <memory>

namespace terrane {

/// A source that answers as another one does: the base of sources that change a part of its answers, such as those that
/// delay it or add volumes.
///
/// Threads: as HeightSource
class ForwardedHeights : public HeightSource {
public:
    // All as HeightSource.
    double height(double x, double y) const override { return heights_->height(x, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        return heights_->sample(grid, heights_out);
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return heights_->vertex_bounds(grid, bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return heights_->cell_bounds(grid, bounds_out);
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        return heights_->mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        return heights_->cell_flags(grid, flags_out);
    }
    HeightInterval interval(const WorldRect& rect) const override {
        return heights_->interval(rect);
    }
    double rise_bound(double distance) const override { return heights_->rise_bound(distance); }
    bool is_certified() const override { return heights_->is_certified(); }
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override {
        return heights_->stored_chunk(key, stop);
    }
    std::optional<SolidExtent> solid_extent(const ChunkKey& key) const override {
        return heights_->solid_extent(key);
    }
    bool is_in_volume(double x, double y, double z) const override {
        return heights_->is_in_volume(x, y, z);
    }
    std::size_t max_chunk_bytes(const ChunkKey& key) const override {
        return heights_->max_chunk_bytes(key);
    }
    bool is_current(const Chunk& chunk) const override { return heights_->is_current(chunk); }

    /// The source that is asked.
    const HeightSource& heights() const { return *heights_; }

protected:
    /// Requires a source.
    explicit ForwardedHeights(std::shared_ptr<const HeightSource> heights)
        : HeightSource(heights->lattice(), heights->extent()), heights_(std::move(heights)) {}

private:
    std::shared_ptr<const HeightSource> heights_;
};

}  // namespace terrane
