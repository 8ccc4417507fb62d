// SPDX-License-Identifier: MIT
#include "bounds/height_pyramid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

constexpr HeightInterval kNothing{std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity()};

void add(HeightInterval& range, const HeightInterval& other) {
    range.low = std::min(range.low, other.low);
    range.high = std::max(range.high, other.high);
}

/// Margin for the rounding of interpolation and distances.
constexpr double kRounding = 1e-9;

}  // namespace

Result<HeightPyramid> HeightPyramid::create(const BilinearGrid& grid, const RasterStore& store,
                                            OpeningProgress& progress) {
    HeightPyramid pyramid;
    pyramid.grid_ = grid;
    if (auto done = pyramid.add_samples(store, progress); !done)
        return tl::unexpected(done.error());
    pyramid.add_levels();
    return pyramid;
}

Result<void> HeightPyramid::add_samples(const RasterStore& store, OpeningProgress& progress) {
    Level level;
    level.columns = std::max((grid_.columns - 1 + kBlockSide - 1) / kBlockSide, 1);
    level.rows = std::max((grid_.rows - 1 + kBlockSide - 1) / kBlockSide, 1);
    level.nodes.assign(
        static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows), kNothing);
    const int width = grid_.columns;
    std::vector<double> strip(static_cast<std::size_t>(width) * (kBlockSide + 1));
    double steepest = 0.0;
    progress.begin(0.6, level.rows);
    for (int by = 0; by < level.rows; ++by) {
        if (auto wanted = progress.step(); !wanted) return wanted;
        const int south = by * kBlockSide;
        const int rows = std::min(kBlockSide + 1, grid_.rows - south);
        if (auto read = store.read(0, south, width, rows, strip); !read) return read;
        HeightInterval* nodes =
            level.nodes.data() + static_cast<std::ptrdiff_t>(by) * level.columns;
        for (int row = 0; row < rows; ++row) {
            const double* line = strip.data() + static_cast<std::ptrdiff_t>(row) * width;
            for (int bx = 0; bx < level.columns; ++bx) {
                const int begin = bx * kBlockSide;
                const int end = std::min(begin + kBlockSide, width - 1);
                for (int column = begin; column <= end; ++column) {
                    add(nodes[bx], {line[column], line[column]});
                }
            }
            if (row + 1 == rows) break;
            const double* next = line + width;
            for (int column = 0; column + 1 < width; ++column) {
                const double rise_x = std::max(std::fabs(line[column + 1] - line[column]),
                                               std::fabs(next[column + 1] - next[column]));
                const double rise_y = std::max(std::fabs(next[column] - line[column]),
                                               std::fabs(next[column + 1] - line[column + 1]));
                const double x = rise_x / grid_.cell_x, y = rise_y / grid_.cell_y;
                steepest = std::max(steepest, x * x + y * y);
            }
        }
    }
    // Covers the rounding of differences, squares and root.
    slope_ = std::sqrt(steepest) * (1.0 + 1e-6);
    levels_.push_back(std::move(level));
    return {};
}

void HeightPyramid::add_levels() {
    while (levels_.back().columns > 1 || levels_.back().rows > 1) {
        const Level& fine = levels_.back();
        Level coarse;
        coarse.columns = (fine.columns + 1) / 2;
        coarse.rows = (fine.rows + 1) / 2;
        coarse.nodes.assign(
            static_cast<std::size_t>(coarse.columns) * static_cast<std::size_t>(coarse.rows),
            kNothing);
        std::size_t at = 0;
        for (int y = 0; y < fine.rows; ++y) {
            for (int x = 0; x < fine.columns; ++x) {
                add(coarse.nodes[static_cast<std::size_t>(y / 2) *
                                     static_cast<std::size_t>(coarse.columns) +
                                 static_cast<std::size_t>(x / 2)],
                    fine.nodes[at++]);
            }
        }
        levels_.push_back(std::move(coarse));
    }
    for (Level& level : levels_) {
        for (int y = 0; y < std::max(level.rows - 1, 1); ++y) {
            for (int x = 0; x < std::max(level.columns - 1, 1); ++x) {
                HeightInterval range = kNothing;
                for (int j = y; j < std::min(y + 2, level.rows); ++j) {
                    for (int i = x; i < std::min(x + 2, level.columns); ++i) {
                        add(range, level.nodes[static_cast<std::size_t>(j) *
                                                   static_cast<std::size_t>(level.columns) +
                                               static_cast<std::size_t>(i)]);
                    }
                }
                level.rise = std::max(level.rise, range.high - range.low);
            }
        }
    }
}

HeightInterval HeightPyramid::interval(const WorldRect& rect) const {
    // Cells that the closed rectangle touches.
    const auto cell = [](double u, int count) {
        return static_cast<int>(std::clamp(u, 0.0, static_cast<double>(std::max(count - 2, 0))));
    };
    const double margin = 1e-9;
    const int west =
        cell(std::floor((rect.west - grid_.west) / grid_.cell_x - margin), grid_.columns);
    const int east =
        cell(std::floor((rect.east - grid_.west) / grid_.cell_x + margin), grid_.columns);
    const int south =
        cell(std::floor((rect.south - grid_.south) / grid_.cell_y - margin), grid_.rows);
    const int north =
        cell(std::floor((rect.north - grid_.south) / grid_.cell_y + margin), grid_.rows);

    // The finest level on which that is at most 8 x 8 nodes.
    std::size_t k = 0;
    int side = kBlockSide;
    while (k + 1 < levels_.size() &&
           (east / side - west / side >= 8 || north / side - south / side >= 8)) {
        ++k;
        side *= 2;
    }
    const Level& level = levels_[k];
    HeightInterval range = kNothing;
    for (int y = south / side; y <= north / side; ++y) {
        for (int x = west / side; x <= east / side; ++x) {
            add(range,
                level.nodes[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.columns) +
                            static_cast<std::size_t>(x)]);
        }
    }
    return {range.low - kRounding, range.high + kRounding};
}

double HeightPyramid::rise_bound(double distance) const {
    const double reach = std::max(distance, 0.0);
    double rise = levels_.back().nodes.front().high - levels_.back().nodes.front().low;
    // Two points at most a node's side apart lie in 2 x 2 adjacent nodes.
    double side = std::min(grid_.cell_x, grid_.cell_y) * kBlockSide;
    for (const Level& level : levels_) {
        if (reach <= side) {
            rise = std::min(rise, level.rise);
            break;
        }
        side *= 2.0;
    }
    return std::min(rise, slope_ * reach * (1.0 + 1e-9)) + kRounding;
}

}  // namespace terrane::internal
