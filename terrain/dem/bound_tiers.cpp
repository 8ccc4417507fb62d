// SPDX-License-Identifier: MIT
#include "bound_tiers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>

namespace terrane::internal {
namespace {

constexpr int kRatio = 8;
/// Points that a tier holds beyond the raster: a vertex there depends on the three around it, and
/// four remainders are needed.
constexpr std::int64_t kBeyond = 8;

}  // namespace

const BoundTier* BoundTiers::tier_for(std::int64_t step) const {
    const BoundTier* found = nullptr;
    for (const BoundTier& tier : tiers_) {
        if (tier.step <= step) found = &tier;
    }
    return found;
}

Result<DiamondWindow> BoundTiers::window(const BoundTier* tier, std::int64_t first_x,
                                         std::int64_t first_y, int columns, int rows) const {
    if (tier == nullptr) return fine_->base_window(first_x, first_y, columns, rows);
    DiamondWindow window;
    window.first_x = first_x;
    window.first_y = first_y;
    window.columns = columns;
    window.rows = rows;
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
            const std::size_t at = tier->at(first_x + x, first_y + y);
            window.heights.push_back(tier->heights[at]);
            window.bounds.push_back(tier->bounds[at]);
            if (x + 1 == columns || y + 1 == rows) continue;
            window.cell_low.push_back(tier->cell_low[at]);
            window.cell_high.push_back(tier->cell_high[at]);
        }
    }
    return window;
}

Result<void> BoundTiers::fill_square(const BoundTier* finer, int ratio, int x, int y, int side,
                                     BoundTier& tier) const {
    const int columns = std::min(side, tier.columns - x), rows = std::min(side, tier.rows - y);
    const int apron = 3 * ratio;
    const std::int64_t west = (tier.first_x + x) * ratio, south = (tier.first_y + y) * ratio;
    auto made = window(finer, west - apron, south - apron, (columns - 1) * ratio + 2 * apron + 1,
                       (rows - 1) * ratio + 2 * apron + 1);
    if (!made) return tl::unexpected(made.error());
    DiamondWindow& window = *made;
    compute_bounds(window, finer == nullptr ? 1 : 2, ratio);
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const int wx = apron + i * ratio, wy = apron + j * ratio;
            const std::size_t at =
                static_cast<std::size_t>(y + j) * static_cast<std::size_t>(tier.columns) +
                static_cast<std::size_t>(x + i);
            tier.heights[at] = window.heights[window.at(wx, wy)];
            tier.bounds[at] = window.bounds[window.at(wx, wy)];
            tier.cell_bounds[at] =
                square_deviation(window, wx + ratio / 2, wy + ratio / 2, ratio / 2);
            const HeightInterval between = bilinear_deviation(window, wx, wy, ratio);
            tier.cell_low[at] = -round_outward(-between.low);
            tier.cell_high[at] = round_outward(between.high);
        }
    }
    return {};
}

Result<BoundTier> BoundTiers::make_tier(const BoundTier* finer, int ratio) const {
    const BilinearGrid& grid = fine_->grid();
    BoundTier tier;
    tier.step = (finer == nullptr ? grid.base_step() : finer->step) * ratio;

    // From the lattice points around the samples' rectangle, and some beyond.
    const double spacing = grid.lattice.spacing * static_cast<double>(tier.step);
    const auto index_below = [&](double from_origin) {
        return static_cast<std::int64_t>(std::floor(from_origin / spacing));
    };
    const double east = grid.west + (grid.columns - 1) * grid.cell_x;
    const double north = grid.south + (grid.rows - 1) * grid.cell_y;
    tier.first_x = index_below(grid.west - grid.lattice.origin_x) - kBeyond;
    tier.first_y = index_below(grid.south - grid.lattice.origin_y) - kBeyond;
    tier.columns = static_cast<int>(index_below(east - grid.lattice.origin_x) + 1 + kBeyond -
                                    tier.first_x + 1);
    tier.rows = static_cast<int>(index_below(north - grid.lattice.origin_y) + 1 + kBeyond -
                                 tier.first_y + 1);
    const std::size_t size =
        static_cast<std::size_t>(tier.columns) * static_cast<std::size_t>(tier.rows);
    tier.heights.resize(size);
    for (auto* values : {&tier.bounds, &tier.cell_bounds, &tier.cell_low, &tier.cell_high}) {
        values->resize(size);
    }
    constexpr int kWindowSide = 512;
    const int side = std::max(8, kWindowSide / ratio);
    // Squares write to places of their own: any number of threads gives the same tier.
    const int across = (tier.columns + side - 1) / side;
    const int count = across * ((tier.rows + side - 1) / side);
    std::atomic<int> next{0};
    std::mutex mutex;
    std::optional<Error> error;
    const auto work = [&] {
        for (int i = next++; i < count; i = next++) {
            const auto done =
                fill_square(finer, ratio, i % across * side, i / across * side, side, tier);
            if (done) continue;
            next = count;
            const std::lock_guard lock(mutex);
            error = done.error();
        }
    };
    {
        std::vector<std::jthread> helpers;
        const int cores = static_cast<int>(std::min(std::thread::hardware_concurrency(), 8u));
        while (static_cast<int>(helpers.size()) + 1 < std::min(cores, count)) {
            helpers.emplace_back(work);
        }
        work();
    }
    if (error) return tl::unexpected(*error);
    return tier;
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::create(std::shared_ptr<const FineSurface> fine) {
    std::unique_ptr<BoundTiers> tiers(new BoundTiers(std::move(fine)));
    const BilinearGrid& grid = tiers->fine_->grid();
    // A first tier in proportion to the raster: at most about 2^22 points.
    constexpr double kMostPoints = 0x1p22;
    constexpr int kMaxRatio = 64;
    const double base = grid.base_spacing();
    const double base_points =
        (grid.columns * grid.cell_x / base) * (grid.rows * grid.cell_y / base);
    int ratio = kRatio;
    while (ratio < kMaxRatio && base_points > kMostPoints * ratio * ratio) ratio *= 2;

    // Vertices of the root squares' halves are owned by the roots, too.
    const std::int64_t coarsest = grid.lattice.chunk_side(0);
    const BoundTier* finer = nullptr;
    do {
        auto tier = tiers->make_tier(finer, ratio);
        if (!tier) return tl::unexpected(tier.error());
        tiers->tiers_.push_back(std::move(*tier));
        finer = &tiers->tiers_.back();
        ratio = kRatio;
    } while (finer->step < coarsest);
    return tiers;
}

bool BoundTiers::has_heights(const SampleGrid& grid) const {
    const std::int64_t step = tiers_.front().step;
    return grid.step >= step && grid.corner.x % step == 0 && grid.corner.y % step == 0;
}

void BoundTiers::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    const BoundTier& tier = tiers_.front();
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            heights_out[at++] =
                tier.heights[tier.at((grid.corner.x + column * grid.step) / tier.step,
                                     (grid.corner.y + row * grid.step) / tier.step)];
        }
    }
}

Result<void> BoundTiers::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const BoundTier* tier = tier_for(grid.step);
    const std::int64_t unit = tier == nullptr ? fine_->grid().base_step() : tier->step;
    const int n = static_cast<int>(grid.step / unit);
    const std::int64_t x = grid.corner.x / unit, y = grid.corner.y / unit;
    std::size_t at = 0;
    if (tier != nullptr && n == 1) {
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                bounds_out[at++] = tier->bounds[tier->at(x + column, y + row)];
            }
        }
        return {};
    }
    const int apron = 3 * n;
    auto made = window(tier, x - apron, y - apron, (grid.columns - 1) * n + 2 * apron + 1,
                       (grid.rows - 1) * n + 2 * apron + 1);
    if (!made) return tl::unexpected(made.error());
    compute_bounds(*made, tier == nullptr ? 1 : 2, n);
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            // The multiples of 2 n are vertices of a coarser spacing.
            const bool is_coarser = ((x / n + column) & 1) == 0 && ((y / n + row) & 1) == 0;
            bounds_out[at++] =
                is_coarser ? 0.0f : made->bounds[made->at(apron + column * n, apron + row * n)];
        }
    }
    return {};
}

Result<void> BoundTiers::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const BoundTier* tier = tier_for(grid.step);
    const std::int64_t unit = tier == nullptr ? fine_->grid().base_step() : tier->step;
    const int n = static_cast<int>(grid.step / unit);
    const std::int64_t x = grid.corner.x / unit, y = grid.corner.y / unit;
    std::size_t at = 0;
    if (tier != nullptr && n == 1) {
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column) {
                bounds_out[at++] = tier->cell_bounds[tier->at(x + column, y + row)];
            }
        }
        return {};
    }
    const auto made = window(tier, x, y, (grid.columns - 1) * n + 1, (grid.rows - 1) * n + 1);
    if (!made) return tl::unexpected(made.error());
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column) {
            bounds_out[at++] = square_deviation(*made, column * n + n / 2, row * n + n / 2, n / 2);
        }
    }
    return {};
}

}  // namespace terrane::internal
