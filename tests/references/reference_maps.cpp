// SPDX-License-Identifier: MIT
#include "reference_maps.h"

#include <terrane/terrain/chunk.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace terrane::test {
namespace {

std::uint32_t mix(std::uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

double fade(double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); }

double lattice_value(int x, int y, std::uint32_t octave) {
    const std::uint32_t hash =
        mix(mix(mix(static_cast<std::uint32_t>(x)) + static_cast<std::uint32_t>(y)) + octave);
    return hash * (2.0 / 4294967295.0) - 1.0;
}

double value_noise(double x, double y, std::uint32_t octave) {
    const double column = std::floor(x), row = std::floor(y);
    const int i = static_cast<int>(column), j = static_cast<int>(row);
    const double u = fade(x - column), v = fade(y - row);
    const double south =
        lattice_value(i, j, octave) * (1.0 - u) + lattice_value(i + 1, j, octave) * u;
    const double north =
        lattice_value(i, j + 1, octave) * (1.0 - u) + lattice_value(i + 1, j + 1, octave) * u;
    return south * (1.0 - v) + north * v;
}

// The table's lattice: a single root square where the longer side allows it.
Lattice lattice_for(const HeightTable& table) {
    constexpr int kMostRoots = 4;
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

}  // namespace

HeightTable make_contact_table(int side, double spacing) {
    constexpr int kOctaves = 10;
    HeightTable table;
    table.columns = table.rows = side;
    table.spacing = spacing;
    table.heights.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const double x = column * spacing, y = row * spacing;
            double height = 0.0;
            for (int octave = 0; octave < kOctaves; ++octave) {
                const double per_metre = std::ldexp(1.0, octave) / 256.0;
                height += std::ldexp(30.0, -octave) *
                          value_noise(x * per_metre, y * per_metre,
                                      1000u + static_cast<std::uint32_t>(octave));
            }
            table.heights.push_back(static_cast<float>(height));
        }
    }
    return table;
}

TableHeights::TableHeights(HeightTable table)
    : HeightSource(lattice_for(table), {0.0, 0.0, (table.columns - 1) * table.spacing,
                                        (table.rows - 1) * table.spacing}),
      table_(std::move(table)) {
    constexpr double kRounding = 1e-9;  // of height(), metres
    const auto [low, high] = std::ranges::minmax(table_.heights);
    range_ = {static_cast<double>(low) - kRounding, static_cast<double>(high) + kRounding};
}

double TableHeights::height(double x, double y) const {
    const double u = std::clamp(x / table_.spacing, 0.0, table_.columns - 1.0);
    const double v = std::clamp(y / table_.spacing, 0.0, table_.rows - 1.0);
    const int column = std::min(static_cast<int>(u), table_.columns - 2);
    const int row = std::min(static_cast<int>(v), table_.rows - 2);
    const double fx = u - column, fy = v - row;
    const auto at = [&](int dx, int dy) {
        return static_cast<double>(table_.at(column + dx, row + dy));
    };
    const double south = at(0, 0) + fx * (at(1, 0) - at(0, 0));
    const double north = at(0, 1) + fx * (at(1, 1) - at(0, 1));
    return south + fy * (north - south);
}

Result<void> TableHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    const auto within = [](std::int64_t place, int count) {
        return static_cast<int>(std::clamp<std::int64_t>(place, 0, count - 1));
    };
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        const int y = within(grid.corner.y + row * grid.step, table_.rows);
        for (int column = 0; column < grid.columns; ++column) {
            const int x = within(grid.corner.x + column * grid.step, table_.columns);
            heights_out[i++] = static_cast<double>(table_.at(x, y));
        }
    }
    return {};
}

Result<void> TableHeights::vertex_bounds(const SampleGrid& grid,
                                         std::span<float> bounds_out) const {
    const auto bound = static_cast<float>(rise_bound(0.0));
    std::size_t i = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            bounds_out[i++] = ((row | column) & 1) == 0 ? 0.0f : bound;
        }
    }
    return {};
}

Result<void> TableHeights::cell_bounds(const SampleGrid&, std::span<float> bounds_out) const {
    std::ranges::fill(bounds_out, static_cast<float>(rise_bound(0.0)));
    return {};
}

HeightInterval TableHeights::interval(const WorldRect&) const { return range_; }

// A little more than the range, so that it holds as a float too.
double TableHeights::rise_bound(double) const { return (range_.high - range_.low) * 1.000001; }

}  // namespace terrane::test
