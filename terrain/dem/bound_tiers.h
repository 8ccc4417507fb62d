// SPDX-License-Identifier: MIT
#pragma once

#include "fine_surface.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// A decimated lattice over a raster with what is known about the surface below it. Beyond the
/// raster the surface repeats its edge, so that an index out there has the values of one just beyond
/// the edge with the same remainder by 4: squares are cut the same way.
struct BoundTier {
    std::int64_t step = 1;                  ///< finest spacings between its points
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point, in steps
    int columns = 0, rows = 0;
    std::vector<double> heights;     ///< [rows * columns]
    std::vector<float> bounds;       ///< [rows * columns] of the vertices of spacing `step`; else 0
    std::vector<float> cell_bounds;  ///< of the two triangles of the cell north-east of a point
    std::vector<float> cell_low, cell_high;  ///< of that cell: see DiamondWindow

    std::size_t at(std::int64_t x, std::int64_t y) const {
        return static_cast<std::size_t>(repeated(y - first_y, rows)) *
                   static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(repeated(x - first_x, columns));
    }

private:
    static std::int64_t repeated(std::int64_t i, std::int64_t count) {
        if (i < 0) return i & 3;
        if (i >= count) return count - 4 + ((i - count) & 3);
        return i;
    }
};

/// Bounds at and above the base spacing. Tier 0 is the raster itself, seen at the base spacing; each
/// further tier is eight times coarser (the first more, for huge rasters) and made from the one
/// before, so that any grid of bounds costs a window of at most half a thousand points a side.
class BoundTiers {
public:
    /// Makes all tiers: one pass over the raster.
    /// Fails: io
    static Result<std::unique_ptr<BoundTiers>> create(std::shared_ptr<const FineSurface> fine);

    /// Heights of a grid whose corner is a multiple of its step, a multiple of the first tier's.
    bool has_heights(const SampleGrid& grid) const;
    void sample(const SampleGrid& grid, std::span<double> heights_out) const;

    /// As HeightSource; requires grid.step >= base step.
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    /// As HeightSource; requires grid.step > base step.
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;

private:
    explicit BoundTiers(std::shared_ptr<const FineSurface> fine) : fine_(std::move(fine)) {}

    /// The coarsest tier whose step is at most `step`; null: the raster itself.
    const BoundTier* tier_for(std::int64_t step) const;
    Result<DiamondWindow> window(const BoundTier* tier, std::int64_t first_x, std::int64_t first_y,
                                 int columns, int rows) const;
    Result<BoundTier> make_tier(const BoundTier* finer, int ratio) const;
    Result<void> fill_square(const BoundTier* finer, int ratio, int x, int y, int side,
                             BoundTier& tier) const;

    std::shared_ptr<const FineSurface> fine_;
    std::vector<BoundTier> tiers_;  ///< from fine to coarse
};

}  // namespace terrane::internal
