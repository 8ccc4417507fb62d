// SPDX-License-Identifier: MIT
//
// The first octaves of the head are so smooth that samples of twice the step are enough: in between
// they are interpolated linearly, the middle of a cell from its south-western and north-eastern corner.
#include "source/fractal/head_samples.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace terrane {
namespace {

/// Samples of twice the step that a grid lies between.
struct Coarse {
    UnitGrid grid;
    int column = 0, row = 0;  ///< of the fine grid's corner, in fine steps

    explicit Coarse(const UnitGrid& fine) {
        const std::uint64_t mask = 2 * fine.step - 1;
        grid = {fine.x & ~mask, fine.y & ~mask, 2 * fine.step};
        column = fine.x == grid.x ? 0 : 1;
        row = fine.y == grid.y ? 0 : 1;
        grid.columns = (column + fine.columns) / 2 + 1;
        grid.rows = (row + fine.rows) / 2 + 1;
    }
    std::size_t size() const {
        return static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
    }
};

/// Means of pairs: every other value is one of two neighbours, `low` and `high` the same or not.
void interpolate_row(const double* low, const double* high, int first, std::span<double> out) {
    std::size_t i = 0;
    if (first != 0) {
        out[i++] = 0.5 * (low[0] + high[1]);
        ++low;
        ++high;
    }
    for (; i + 1 < out.size(); i += 2, ++low, ++high) {
        out[i] = 0.5 * (low[0] + high[0]);
        out[i + 1] = 0.5 * (low[0] + high[1]);
    }
    if (i < out.size()) out[i] = 0.5 * (low[0] + high[0]);
}

void interpolate(const Coarse& coarse, std::span<const double> values, const UnitGrid& grid,
                 std::span<double> out) {
    const auto width = static_cast<std::size_t>(coarse.grid.columns);
    const auto columns = static_cast<std::size_t>(grid.columns);
    for (int row = 0; row < grid.rows; ++row) {
        const auto south = static_cast<std::size_t>((coarse.row + row) / 2);
        const auto north = static_cast<std::size_t>((coarse.row + row + 1) / 2);
        interpolate_row(&values[south * width], &values[north * width], coarse.column,
                        out.subspan(static_cast<std::size_t>(row) * columns, columns));
    }
}

}  // namespace

void HeadSamples::sample(const UnitGrid& grid, std::span<double> centres_out,
                         std::span<double> radii_out) {
    const Coarse coarse(grid);
    sums_.assign(coarse.size(), 0.0);
    weights_.assign(has_radii() ? coarse.size() : 0, 1.0);
    surface_.add_octaves(coarse.grid, 0, head_.coarse_count, level_, sums_, weights_);
    interpolate(coarse, sums_, grid, centres_out);
    if (has_radii()) interpolate(coarse, weights_, grid, radii_out);
    surface_.add_octaves(grid, head_.coarse_count, head_.octave_count, level_, centres_out,
                         radii_out);
    for (std::size_t i = 0; i < radii_out.size(); ++i) {
        const double weight = radii_out[i];
        centres_out[i] += head_.centre + head_.centre_slope * weight;
        radii_out[i] = head_.radius + head_.radius_slope * weight;
    }
}

}  // namespace terrane
