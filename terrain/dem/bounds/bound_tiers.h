// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tier.h"
#include "surface/fine_surface.h"
#include "raster/opening_progress.h"

#include <terrane/store/bytes.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Bounds that are made once, and held. The first tier is eight times coarser than the base spacing
/// (more, for huge rasters): below it a grid of bounds costs a window of at most half a thousand points
/// a side, and is made when it is asked for.
class BoundTiers {
public:
    /// Makes all tiers: two passes over the raster.
    /// Fails: io; cancelled
    static Result<std::unique_ptr<BoundTiers>> create(std::shared_ptr<const FineSurface> fine,
                                                      OpeningProgress& progress);

    /// About how many points the first tier has.
    static double first_points(const BilinearGrid& grid);

    /// What opening_cache keeps; read() fails with bad_data where it is not of this surface.
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

    /// Work of making the tiers above the first one: tiles visited, counted for every triangle.
    std::int64_t tile_visits() const { return tile_visits_; }

private:
    explicit BoundTiers(std::shared_ptr<const FineSurface> fine) : fine_(std::move(fine)) {}

    const BoundTier& first() const { return tiers_.front(); }
    /// The tier of a spacing; null: coarser than a root square.
    const BoundTier* find(std::int64_t step) const;
    /// Its extent, without values.
    BoundTier make_extent(std::int64_t step) const;
    Result<void> make_first(int ratio, OpeningProgress& progress);
    Result<void> fill_square(int ratio, int x, int y, int side, BoundTier& tier) const;
    Result<void> make_coarser(OpeningProgress& progress);
    void nest(std::size_t level);

    std::shared_ptr<const FineSurface> fine_;
    std::vector<BoundTier> tiers_;  ///< each of twice the spacing of the one before
    float largest_ = 0.0f;          ///< no surface leaves any triangle by more
    std::int64_t tile_visits_ = 0;
};

}  // namespace terrane::internal
