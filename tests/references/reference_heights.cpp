// SPDX-License-Identifier: MIT
#include "reference_maps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace terrane::test {
namespace {

constexpr int kMostRoots = 4;

// The table's lattice: a single root square where the longer side allows it.
Lattice lattice_for(const HeightTable& table) {
    const int longer = std::max(table.columns, table.rows) - 1;
    int level = 0;
    while ((kMostRoots * kChunkCells << level) < longer) ++level;
    for (int whole = level; (kChunkCells << whole) <= longer; ++whole) {
        if ((kChunkCells << whole) == longer) level = whole;
    }
    const int root = kChunkCells << level;
    Lattice lattice;
    lattice.spacing = table.spacing;
    lattice.finest_level = level;
    lattice.root_count_x = std::max(1, (table.columns - 2 + root) / root);
    lattice.root_count_y = std::max(1, (table.rows - 2 + root) / root);
    return lattice;
}

HeightTable pad(const HeightTable& table, const Lattice& lattice) {
    HeightTable padded;
    padded.columns = static_cast<int>(lattice.east()) + 1;
    padded.rows = static_cast<int>(lattice.north()) + 1;
    padded.spacing = table.spacing;
    padded.heights.reserve(static_cast<std::size_t>(padded.columns) *
                           static_cast<std::size_t>(padded.rows));
    for (int y = 0; y < padded.rows; ++y) {
        for (int x = 0; x < padded.columns; ++x) {
            padded.heights.push_back(
                table.at(std::min(x, table.columns - 1), std::min(y, table.rows - 1)));
        }
    }
    return padded;
}

}  // namespace

TableHeights::TableHeights(HeightTable table)
    : HeightSource(lattice_for(table), {0.0, 0.0, (table.columns - 1) * table.spacing,
                                        (table.rows - 1) * table.spacing}),
      padded_(pad(table, lattice())) {
    DiamondBounds made = make_diamond_bounds(padded_, kChunkCells << lattice().finest_level);
    bounds_ = std::move(made.nested);
    square_bounds_ = std::move(made.own);
    largest_bound_ = *std::max_element(bounds_.begin(), bounds_.end());
    make_ranges();
    make_steepness();
}

double TableHeights::height(double x, double y) const {
    const double u = std::clamp(x / padded_.spacing, 0.0, padded_.columns - 1.0);
    const double v = std::clamp(y / padded_.spacing, 0.0, padded_.rows - 1.0);
    const int column = std::min(static_cast<int>(u), padded_.columns - 2);
    const int row = std::min(static_cast<int>(v), padded_.rows - 2);
    const double fx = u - column, fy = v - row;
    const auto at = [&](int dx, int dy) {
        return static_cast<double>(padded_.at(column + dx, row + dy));
    };
    const double south = at(0, 0) + fx * (at(1, 0) - at(0, 0));
    const double north = at(0, 1) + fx * (at(1, 1) - at(0, 1));
    return south + fy * (north - south);
}

Result<void> TableHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        const auto y =
            std::clamp<std::int64_t>(grid.corner.y + row * grid.step, 0, padded_.rows - 1);
        for (int column = 0; column < grid.columns; ++column) {
            const auto x = std::clamp<std::int64_t>(grid.corner.x + column * grid.step, 0,
                                                    padded_.columns - 1);
            heights_out[i++] =
                static_cast<double>(padded_.at(static_cast<int>(x), static_cast<int>(y)));
        }
    }
    return {};
}

Result<void> TableHeights::vertex_bounds(const SampleGrid& grid,
                                         std::span<float> bounds_out) const {
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++i) {
            bounds_out[i] = 0.0f;
            if (((row | column) & 1) == 0) continue;
            const std::int64_t x = grid.corner.x + column * grid.step;
            const std::int64_t y = grid.corner.y + row * grid.step;
            const bool inside = x >= 0 && y >= 0 && x < padded_.columns && y < padded_.rows &&
                                2 * grid.step <= lattice().chunk_side(0);
            bounds_out[i] = inside
                                ? bounds_[padded_.index(static_cast<int>(x), static_cast<int>(y))]
                                : largest_bound_;
        }
    }
    return {};
}

Result<void> TableHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    std::size_t i = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column, ++i) {
            const std::int64_t x = grid.corner.x + column * grid.step;
            const std::int64_t y = grid.corner.y + row * grid.step;
            if (x < 0 || y < 0 || x + grid.step >= padded_.columns ||
                y + grid.step >= padded_.rows || grid.step > lattice().chunk_side(0)) {
                bounds_out[i] = largest_bound_;
                continue;
            }
            const auto west = static_cast<int>(x), south = static_cast<int>(y);
            if (grid.step > 1) {
                const auto half = static_cast<int>(grid.step / 2);
                bounds_out[i] = square_bounds_[padded_.index(west + half, south + half)];
                continue;
            }
            const auto at = [&](int dx, int dy) {
                return static_cast<double>(padded_.at(west + dx, south + dy));
            };
            const double bend = at(0, 0) - at(1, 0) - at(0, 1) + at(1, 1);
            bounds_out[i] = std::nextafter(static_cast<float>(0.25 * std::abs(bend) + 1e-9),
                                           std::numeric_limits<float>::infinity());
        }
    }
    return {};
}

void TableHeights::make_ranges() {
    Ranges cells;
    cells.columns = padded_.columns - 1;
    cells.rows = padded_.rows - 1;
    for (int y = 0; y < cells.rows; ++y) {
        for (int x = 0; x < cells.columns; ++x) {
            const auto [low, high] = std::minmax({padded_.at(x, y), padded_.at(x + 1, y),
                                                  padded_.at(x, y + 1), padded_.at(x + 1, y + 1)});
            cells.low.push_back(low);
            cells.high.push_back(high);
        }
    }
    ranges_.push_back(std::move(cells));
    while (ranges_.back().columns % 2 == 0 && ranges_.back().rows % 2 == 0) {
        const Ranges& finer = ranges_.back();
        Ranges made;
        made.columns = finer.columns / 2;
        made.rows = finer.rows / 2;
        for (int y = 0; y < made.rows; ++y) {
            for (int x = 0; x < made.columns; ++x) {
                const auto first = static_cast<std::size_t>(2 * y * finer.columns + 2 * x);
                const std::size_t next = first + static_cast<std::size_t>(finer.columns);
                made.low.push_back(std::min({finer.low[first], finer.low[first + 1],
                                             finer.low[next], finer.low[next + 1]}));
                made.high.push_back(std::max({finer.high[first], finer.high[first + 1],
                                              finer.high[next], finer.high[next + 1]}));
            }
        }
        ranges_.push_back(std::move(made));
    }
}

// Two points at most 2^n cells apart lie in two by two squares of 2^n cells.
void TableHeights::make_steepness() {
    for (int y = 0; y + 1 < padded_.rows; ++y) {
        for (int x = 0; x + 1 < padded_.columns; ++x) {
            const auto rise = [&](int x0, int y0, int x1, int y1) {
                return std::abs(static_cast<double>(padded_.at(x1, y1)) -
                                static_cast<double>(padded_.at(x0, y0)));
            };
            const double along_x = std::max(rise(x, y, x + 1, y), rise(x, y + 1, x + 1, y + 1));
            const double along_y = std::max(rise(x, y, x, y + 1), rise(x + 1, y, x + 1, y + 1));
            steepness_ = std::max(steepness_, along_x * along_x + along_y * along_y);
        }
    }
    steepness_ = std::sqrt(steepness_) / padded_.spacing * (1.0 + 1e-12);
    for (const Ranges& squares : ranges_) {
        double largest = 0.0;
        for (int y = 0; y < squares.rows; ++y) {
            for (int x = 0; x < squares.columns; ++x) {
                float low = std::numeric_limits<float>::max(), high = -low;
                for (int j = y; j <= std::min(y + 1, squares.rows - 1); ++j) {
                    for (int i = x; i <= std::min(x + 1, squares.columns - 1); ++i) {
                        const auto at = static_cast<std::size_t>(j * squares.columns + i);
                        low = std::min(low, squares.low[at]);
                        high = std::max(high, squares.high[at]);
                    }
                }
                largest = std::max(largest, static_cast<double>(high) - static_cast<double>(low));
            }
        }
        rises_.push_back(std::max(largest, rises_.empty() ? 0.0 : rises_.back()));
    }
}

HeightInterval TableHeights::interval(const WorldRect& rect) const {
    const auto cell = [](double place, int count) {
        return static_cast<int>(std::clamp(std::floor(place), 0.0, count - 1.0));
    };
    const Ranges& cells = ranges_.front();
    const int west = cell(rect.west / padded_.spacing, cells.columns);
    const int south = cell(rect.south / padded_.spacing, cells.rows);
    const int east = cell(rect.east / padded_.spacing, cells.columns);
    const int north = cell(rect.north / padded_.spacing, cells.rows);
    std::size_t n = 0;
    while (n + 1 < ranges_.size() && (std::max(east - west, north - south) >> n) > 4) ++n;
    const Ranges& squares = ranges_[n];
    constexpr double kRounding = 1e-9;  // of height(), metres
    HeightInterval all{std::numeric_limits<double>::infinity(),
                       -std::numeric_limits<double>::infinity()};
    for (int y = south >> n; y <= north >> n; ++y) {
        for (int x = west >> n; x <= east >> n; ++x) {
            const auto at = static_cast<std::size_t>(y * squares.columns + x);
            all.low = std::min(all.low, static_cast<double>(squares.low[at]) - kRounding);
            all.high = std::max(all.high, static_cast<double>(squares.high[at]) + kRounding);
        }
    }
    return all;
}

double TableHeights::rise_bound(double distance) const {
    const double by_steepness = steepness_ * distance;
    double reach = padded_.spacing;
    for (const double rise : rises_) {
        if (distance <= reach) return std::min(rise, by_steepness);
        reach *= 2.0;
    }
    const Ranges& whole = ranges_.back();
    const double range = static_cast<double>(*std::ranges::max_element(whole.high)) -
                         static_cast<double>(*std::ranges::min_element(whole.low));
    return std::min(range, by_steepness);
}

}  // namespace terrane::test
