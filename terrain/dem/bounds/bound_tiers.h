// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tier.h"
#include "raster/opening_progress.h"
#include "surface/fine_surface.h"

#include <terrane/store/bytes.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Bounds that are computed once and kept. The first tier is eight times coarser than the base spacing (more for huge
/// rasters): finer bounds need a window of at most about 500 points a side, and are computed on demand.
class BoundTiers {
public:
    /// Computes all tiers: two passes over the raster.
    /// Fails: io; cancelled
    static Result<std::unique_ptr<BoundTiers>> create(std::shared_ptr<const FineSurface> fine,
                                                      OpeningProgress& progress);

    /// Approximate number of points of the first tier.
    static double first_points(const BilinearGrid& grid);

    /// For opening_cache; read() fails with bad_data if the bytes are not of this surface.
    void write(ByteWriter& out) const;
    static Result<std::unique_ptr<BoundTiers>> read(std::shared_ptr<const FineSurface> fine,
                                                    ByteReader& in);

    /// Heights of a grid whose corner is a multiple of its step, a multiple of the first tier's.
    bool has_heights(const SampleGrid& grid) const;
    void sample(const SampleGrid& grid, std::span<double> heights_out) const;

    /// As HeightSource; both require grid.step >= first_step().
    void vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    void cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    std::int64_t first_step() const { return first().step; }

    /// Work of computing the tiers above the first one: visited tiles, summed over triangles.
    std::int64_t tile_visits() const { return tile_visits_; }

private:
    explicit BoundTiers(std::shared_ptr<const FineSurface> fine) : fine_(std::move(fine)) {}

    const BoundTier& first() const { return tiers_.front(); }
    /// The tier of a spacing; null if coarser than a root square.
    const BoundTier* find(std::int64_t step) const;
    /// Its extent, without values.
    BoundTier make_extent(std::int64_t step) const;
    Result<void> make_first(int ratio, OpeningProgress& progress);
    Result<void> fill_square(int ratio, int x, int y, int side, BoundTier& tier) const;
    Result<void> make_coarser(OpeningProgress& progress);
    void nest(std::size_t level);

    std::shared_ptr<const FineSurface> fine_;
    std::vector<BoundTier> tiers_;  ///< each of twice the spacing of the one before
    float largest_ = 0.0f;          ///< upper bound of all deviations
    std::int64_t tile_visits_ = 0;
};

}  // namespace terrane::internal
