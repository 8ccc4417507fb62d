// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tiers.h"
#include "bounds/height_pyramid.h"
#include "opening_cache.h"
#include "raster/raster_store.h"
#include "surface/fine_surface.h"

#include <terrane/dem/dem_heights.h>

#include <functional>
#include <memory>
#include <string>

namespace terrane::internal {

/// The bilinear surface of a raster as a source of heights; immutable once made.
class DemSource final : public HeightSource {
public:
    /// Fails: io; timed_out; cancelled; bad_data; out_of_memory; invalid_argument if the finest
    ///        spacing is out of range
    static Result<std::shared_ptr<const DemSource>> create(
        const std::string& path, double finest_spacing, const StoreSettings& settings,
        std::function<bool(double)> report_progress = {}, double spacing_tolerance = 1.0);

    const DemInfo& info() const { return store_->info(); }
    const BilinearGrid& grid() const { return fine_->grid(); }
    const RasterStore& store() const { return *store_; }
    const CacheUse& cache_use() const { return cache_use_; }

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

private:
    DemSource(std::shared_ptr<const RasterStore> store, std::shared_ptr<const FineSurface> fine,
              OpeningBounds bounds, CacheUse cache_use);

    void add_base(std::span<double> heights) const;
    /// Adds the packing error of samples to bounds.
    void add_rounding(std::span<float> bounds) const;

    std::shared_ptr<const RasterStore> store_;
    std::shared_ptr<const FineSurface> fine_;
    std::unique_ptr<const BoundTiers> tiers_;
    HeightPyramid pyramid_;
    CacheUse cache_use_;
};

}  // namespace terrane::internal
