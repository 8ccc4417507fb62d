// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <memory>
#include <optional>

namespace terrane::internal {

/// A part of another source's world as a world of its own: its coarser levels, or a region. Positions, heights and
/// bounds are the other source's.
class PartHeights final : public HeightSource {
public:
    /// @param base        must outlive the part
    /// @param level_count levels from the root squares on; 0 for all
    /// @param region      metres, widened to whole root squares of the part; absent: everything
    ///
    /// Fails: invalid_argument if there are fewer levels, or the region is empty or lies outside
    static Result<std::unique_ptr<const PartHeights>> create(
        const HeightSource& base, int level_count, const std::optional<WorldRect>& region);

    double height(double x, double y) const override { return base_.height(x, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        return base_.sample(widen(grid), heights_out);
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.vertex_bounds(widen(grid), bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.cell_bounds(widen(grid), bounds_out);
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        return base_.mesh_bounds(widen(grid), vertex_bounds_out, cell_bounds_out);
    }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        return base_.cell_flags(widen(grid), flags_out);
    }
    HeightInterval interval(const WorldRect& rect) const override { return base_.interval(rect); }
    double rise_bound(double distance) const override { return base_.rise_bound(distance); }

private:
    PartHeights(const HeightSource& base, const Lattice& lattice, const WorldRect& extent,
                int shift)
        : HeightSource(lattice, extent), base_(base), shift_(shift) {}
    /// Converts to the other source's finest spacings.
    SampleGrid widen(const SampleGrid& grid) const {
        const std::int64_t factor = std::int64_t{1} << shift_;
        return {{grid.corner.x * factor, grid.corner.y * factor},
                grid.step * factor,
                grid.columns,
                grid.rows};
    }

    const HeightSource& base_;
    int shift_ = 0;  ///< levels of the other source below the part's finest
};

}  // namespace terrane::internal
