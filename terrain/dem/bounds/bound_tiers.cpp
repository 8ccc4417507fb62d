// SPDX-License-Identifier: MIT
#include "bounds/bound_tiers.h"

#include "bounds/deviation_sweep.h"
#include "bounds/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace terrane::internal {
namespace {

constexpr int kRatio = 8;

double base_points(const BilinearGrid& grid) {
    const double base = grid.base_spacing();
    return (grid.columns * grid.cell_x / base) * (grid.rows * grid.cell_y / base);
}

/// A first tier in proportion to the raster: at most about 2^22 points.
int first_ratio(const BilinearGrid& grid) {
    constexpr double kMostPoints = 0x1p22;
    constexpr int kMaxRatio = 64;
    int ratio = kRatio;
    while (ratio < kMaxRatio && base_points(grid) > kMostPoints * ratio * ratio) ratio *= 2;
    return ratio;
}

}  // namespace

const BoundTier* BoundTiers::find(std::int64_t step) const {
    for (const BoundTier& tier : tiers_) {
        if (tier.step == step) return &tier;
    }
    return nullptr;
}

BoundTier BoundTiers::make_extent(std::int64_t step) const {
    const BilinearGrid& grid = fine_->grid();
    BoundTier tier;
    tier.step = step;
    // The lattice points around the samples' rectangle, and a margin.
    const double spacing = grid.lattice.spacing * static_cast<double>(step);
    const auto index_below = [&](double from_origin) {
        return static_cast<std::int64_t>(std::floor(from_origin / spacing));
    };
    const double east = grid.west + (grid.columns - 1) * grid.cell_x;
    const double north = grid.south + (grid.rows - 1) * grid.cell_y;
    tier.first_x = index_below(grid.west - grid.lattice.origin_x) - kBeyondRaster;
    tier.first_y = index_below(grid.south - grid.lattice.origin_y) - kBeyondRaster;
    tier.columns = static_cast<int>(index_below(east - grid.lattice.origin_x) + 1 + kBeyondRaster -
                                    tier.first_x + 1);
    tier.rows = static_cast<int>(index_below(north - grid.lattice.origin_y) + 1 + kBeyondRaster -
                                 tier.first_y + 1);
    const std::size_t size =
        static_cast<std::size_t>(tier.columns) * static_cast<std::size_t>(tier.rows);
    tier.bounds.resize(size);
    tier.cell_bounds.resize(size);
    return tier;
}

Result<void> BoundTiers::fill_square(int ratio, int x, int y, int side, BoundTier& tier) const {
    const int columns = std::min(side, tier.columns - x), rows = std::min(side, tier.rows - y);
    const int apron = 3 * ratio;
    const std::int64_t west = (tier.first_x + x) * ratio, south = (tier.first_y + y) * ratio;
    const std::int64_t step = fine_->grid().base_step();
    auto made = fine_->bounds_window({{(west - apron) * step, (south - apron) * step},
                                      step,
                                      (columns - 1) * ratio + 2 * apron + 1,
                                      (rows - 1) * ratio + 2 * apron + 1});
    if (!made) return tl::unexpected(made.error());
    DiamondWindow& window = *made;
    compute_bounds(window, ratio);
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const int wx = apron + i * ratio, wy = apron + j * ratio;
            const std::size_t at =
                static_cast<std::size_t>(y + j) * static_cast<std::size_t>(tier.columns) +
                static_cast<std::size_t>(x + i);
            tier.heights[at] = window.heights[window.at(wx, wy)];
            tier.bounds[at] = window.bounds[window.at(wx, wy)];
            tier.cell_bounds[at] = cell_deviation(window, wx, wy, ratio);
            const HeightInterval between = bilinear_deviation(window, wx, wy, ratio);
            tier.cell_low[at] = -round_outward(-between.low);
            tier.cell_high[at] = round_outward(between.high);
        }
    }
    return {};
}

Result<void> BoundTiers::make_first(int ratio, OpeningProgress& progress) {
    BoundTier tier = make_extent(fine_->grid().base_step() * ratio);
    tier.heights.resize(tier.bounds.size());
    tier.cell_low.resize(tier.bounds.size());
    tier.cell_high.resize(tier.bounds.size());
    constexpr int kWindowSide = 512;
    const int side = std::max(8, kWindowSide / ratio);
    // Each square writes its own entries: any number of threads gives the same tier.
    const int across = (tier.columns + side - 1) / side;
    const int count = across * ((tier.rows + side - 1) / side);
    progress.begin(0.85, count);
    auto done = in_parallel(count, [&](int i) -> Result<void> {
        auto filled = fill_square(ratio, i % across * side, i / across * side, side, tier);
        return filled ? progress.step() : filled;
    });
    if (!done) return done;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < tier.heights.size(); ++i) {
        low = std::min(low, tier.heights[i]);
        high = std::max(high, tier.heights[i]);
    }
    // Bound of the surface's distance from the interpolation of a cell's corners.
    low += static_cast<double>(*std::ranges::min_element(tier.cell_low));
    high += static_cast<double>(*std::ranges::max_element(tier.cell_high));
    largest_ = round_outward(high - low);
    tiers_.push_back(std::move(tier));
    return {};
}

Result<void> BoundTiers::make_coarser(OpeningProgress& progress) {
    // Roots own the vertices of half their side, too.
    const std::int64_t coarsest = fine_->grid().lattice.chunk_side(0);
    while (tiers_.back().step < coarsest) tiers_.push_back(make_extent(2 * tiers_.back().step));
    const std::span<BoundTier> coarser = std::span(tiers_).subspan(1);
    const auto visits = find_deviations(*fine_, first(), coarser, progress);
    if (!visits) return tl::unexpected(visits.error());
    tile_visits_ = *visits;
    for (std::size_t level = 1; level < tiers_.size(); ++level) nest(level);
    return {};
}

/// Computes the bounds of a tier's vertices from the deviations of its midpoints and cells.
void BoundTiers::nest(std::size_t level) {
    BoundTier& tier = tiers_[level];
    if (level + 1 == tiers_.size()) {
        // The coarsest tier's deviations are not computed, and not needed.
        std::ranges::fill(tier.bounds, largest_);
        return;
    }
    const BoundTier& finer = tiers_[level - 1];
    const BoundTier& coarser = tiers_[level + 1];
    const auto for_each_vertex = [&tier](bool centres, auto&& visit) {
        for (std::int64_t y = tier.first_y; y < tier.first_y + tier.rows; ++y) {
            for (std::int64_t x = tier.first_x; x < tier.first_x + tier.columns; ++x) {
                const bool is_centre = (x & y & 1) != 0, is_vertex = ((x | y) & 1) != 0;
                if (is_vertex && is_centre == centres) visit(x, y, tier.bounds[tier.at(x, y)]);
            }
        }
    };
    const auto largest = [](const BoundTier& of, std::int64_t x, std::int64_t y, int dx, int dy) {
        return std::max(of.bounds[of.at(x + dx, y + dy)], of.bounds[of.at(x - dx, y - dy)]);
    };
    for_each_vertex(false, [&](std::int64_t x, std::int64_t y, float& bound) {
        bound = std::max(bound, std::max(largest(finer, 2 * x, 2 * y, 1, 1),
                                         largest(finer, 2 * x, 2 * y, 1, -1)));
    });
    for_each_vertex(true, [&](std::int64_t x, std::int64_t y, float& bound) {
        const float own = coarser.cell_bounds[coarser.at(x >> 1, y >> 1)];
        bound = std::max(own, std::max(largest(tier, x, y, 1, 0), largest(tier, x, y, 0, 1)));
    });
}

double BoundTiers::first_points(const BilinearGrid& grid) {
    const double ratio = first_ratio(grid), spacing = ratio * grid.base_spacing();
    constexpr double kAround = 2.0 * kBeyondRaster + 3.0;
    return (grid.columns * grid.cell_x / spacing + kAround) *
           (grid.rows * grid.cell_y / spacing + kAround);
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::create(std::shared_ptr<const FineSurface> fine,
                                                       OpeningProgress& progress) {
    std::unique_ptr<BoundTiers> tiers(new BoundTiers(std::move(fine)));
    const int ratio = first_ratio(tiers->fine_->grid());
    if (auto made = tiers->make_first(ratio, progress); !made) return tl::unexpected(made.error());
    if (auto made = tiers->make_coarser(progress); !made) return tl::unexpected(made.error());
    return tiers;
}

bool BoundTiers::has_heights(const SampleGrid& grid) const {
    const std::int64_t step = first().step;
    return grid.step >= step && grid.corner.x % step == 0 && grid.corner.y % step == 0;
}

void BoundTiers::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    const BoundTier& tier = first();
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            heights_out[at++] =
                tier.heights[tier.at((grid.corner.x + column * grid.step) / tier.step,
                                     (grid.corner.y + row * grid.step) / tier.step)];
        }
    }
}

void BoundTiers::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const BoundTier* tier = find(grid.step);
    const std::int64_t x = grid.corner.x / grid.step, y = grid.corner.y / grid.step;
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const float bound =
                tier == nullptr ? largest_ : tier->bounds[tier->at(x + column, y + row)];
            // Points of even column and row are vertices of a coarser spacing.
            bounds_out[at++] = (((x + column) | (y + row)) & 1) == 0 ? 0.0f : bound;
        }
    }
}

void BoundTiers::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const BoundTier* tier = find(grid.step);
    const std::int64_t x = grid.corner.x / grid.step, y = grid.corner.y / grid.step;
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column) {
            bounds_out[at++] =
                tier == nullptr ? largest_ : tier->cell_bounds[tier->at(x + column, y + row)];
        }
    }
}

}  // namespace terrane::internal
