// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/fine_surface.h"
#include "bounds/level_bounds.h"
#include "opening_files.h"
#include "raster/cancellable_work.h"
#include "raster/raster_store.h"

#include <terrane/dem/dem_heights.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace terrane::internal {

/// Upper bounds of the memory during and after opening a raster, bytes, excluding its nodata and GDAL's cache.
struct OpeningBytes {
    double arrays = 0.0;  ///< with entries for blocks of samples and points of tiers
    double others = 0.0;

    /// @param held_bytes bytes of the samples that are held: all, or the cache of a raster that is read by window
    static OpeningBytes of(const BilinearGrid& grid, double held_bytes);
};

/// The bilinear surface of a raster as a height source; immutable.
class DemSource final : public HeightSource, public BilinearSource {
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
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;
    const FineSurface* bilinear_surface() const override;

private:
    /// Opens a raster that is not resampled, from the file settings.scan_file.
    static Result<std::shared_ptr<const DemSource>> reopen(std::shared_ptr<RasterReader> reader,
                                                           double finest_spacing,
                                                           const StoreSettings& settings,
                                                           double spacing_tolerance,
                                                           OpeningProgress& progress);
    DemSource(std::shared_ptr<const RasterStore> store, std::shared_ptr<const FineSurface> fine,
              OpeningBounds bounds, CacheUse cache_use);

    void add_base(std::span<double> heights) const;
    /// Adds store_error() to the bounds of vertices or cells.
    void add_vertex_errors(const SampleGrid& grid, std::span<float> bounds) const;
    void add_cell_errors(const SampleGrid& grid, std::span<float> bounds) const;
    /// Bound of the distance between the stored surface and the file's over a closed rectangle of the lattice.
    double store_error(LatticePoint low, LatticePoint high) const;

    std::shared_ptr<const RasterStore> store_;
    std::shared_ptr<const FineSurface> fine_;
    std::unique_ptr<const BoundTiers> tiers_;
    HeightPyramid pyramid_;
    CacheUse cache_use_;
};

}  // namespace terrane::internal
