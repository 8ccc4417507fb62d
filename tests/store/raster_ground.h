// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/fine_surface.h"

#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace terrane::test {

/// Samples in memory.
class MemorySamples final : public internal::RasterSamples {
public:
    MemorySamples(int columns, int rows, std::vector<float> samples)
        : columns_(columns), rows_(rows), samples_(std::move(samples)) {}

    const internal::SamplePacking& packing() const override { return packing_; }
    double rounding() const override { return 0.0; }
    Result<void> read(std::int64_t column, std::int64_t row, int columns, int rows,
                      std::span<double> heights_out) const override {
        const auto run = [this](std::int64_t from, std::int64_t of_row, int count,
                                double* out) -> Result<void> {
            const auto begin = samples_.begin() + of_row * columns_ + from;
            std::copy(begin, begin + count, out);
            return {};
        };
        return internal::read_window(columns_, rows_, column, row, columns, rows, heights_out, run);
    }

private:
    int columns_, rows_;
    std::vector<float> samples_;
    internal::SamplePacking packing_ = internal::SamplePacking::of_floats(1.0, 0.0);
};

/// A raster as a height source: two levels, with cells of 1 m along x. If cells are as long along y, samples are
/// lattice points. Its bounds above four cells are its whole range of heights.
class RasterGround final : public HeightSource, public internal::BilinearSource {
public:
    static std::shared_ptr<const RasterGround> create(
        int columns, int rows, double cell_y, const std::function<float(int, int)>& height_at) {
        std::vector<float> samples;
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column < columns; ++column) {
                samples.push_back(height_at(column, row));
            }
        }
        internal::BilinearGrid grid;
        grid.columns = columns;
        grid.rows = rows;
        grid.cell_x = 1.0;
        grid.cell_y = cell_y;
        grid.aligned = cell_y == 1.0;
        if (grid.aligned) grid.first = {1, 1};
        // off the lattice by less than a cell
        grid.west = grid.aligned ? 1.0 : 0.75;
        grid.south = grid.aligned ? 1.0 : 0.25;
        grid.lattice.finest_level = 1;
        const auto roots = [](double length) {
            return static_cast<std::int32_t>(std::ceil((length + 1.0) / (2 * kChunkCells)));
        };
        grid.lattice.root_count_x = roots(columns);
        grid.lattice.root_count_y = roots(rows * cell_y);
        return std::shared_ptr<const RasterGround>(new RasterGround(grid, std::move(samples)));
    }

    const internal::FineSurface* bilinear_surface() const override { return &surface_; }

    double height(double x, double y) const override {
        const internal::BilinearGrid& grid = surface_.grid();
        return surface_.height(grid.column_at(x), grid.row_at(y))
            .value_or(std::numeric_limits<double>::quiet_NaN());
    }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        const auto patch = surface_.patch(grid, 0);
        if (!patch) return tl::unexpected(patch.error());
        surface_.sample(*patch, grid, heights_out);
        return {};
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (grid.step <= kFine) return surface_.vertex_bounds(grid, bounds_out);
        std::ranges::fill(bounds_out, most_);
        return {};
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (grid.step <= kFine) return surface_.cell_bounds(grid, bounds_out);
        std::ranges::fill(bounds_out, most_);
        return {};
    }
    HeightInterval interval(const WorldRect&) const override { return range_; }
    double rise_bound(double distance) const override {
        return std::min(range_.high - range_.low, slope_ * distance);
    }

private:
    static constexpr std::int64_t kFine = 4;

    RasterGround(const internal::BilinearGrid& grid, std::vector<float> samples)
        : HeightSource(grid.lattice, {0.0, 0.0, 1.0 + grid.columns, 1.0 + grid.rows * grid.cell_y}),
          range_{*std::ranges::min_element(samples), *std::ranges::max_element(samples)},
          most_(std::nextafter(static_cast<float>(range_.high - range_.low),
                               std::numeric_limits<float>::infinity())),
          slope_(2.0 * (range_.high - range_.low)),
          surface_(grid, std::make_shared<const MemorySamples>(grid.columns, grid.rows,
                                                               std::move(samples))) {}

    HeightInterval range_;
    float most_;
    double slope_;
    internal::FineSurface surface_;
};

/// A raster of 300 x 200 samples with hills of a few metres, in steps of a centimetre.
inline std::shared_ptr<const RasterGround> small_raster(double cell_y) {
    return RasterGround::create(300, 200, cell_y, [](int column, int row) {
        const double height = 20.0 + 3.0 * std::sin(0.05 * column) * std::cos(0.08 * row) +
                              0.01 * ((column * 7919 + row * 104729) % 13);
        return static_cast<float>(std::floor(100.0 * height + 0.5) / 100.0);
    });
}

}  // namespace terrane::test
