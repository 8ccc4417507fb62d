// SPDX-License-Identifier: MIT
//
// Bounds e(v) that are valid for the diamond of v, nested (e(v) >= e of its children) and functions of
// the address alone, from samples at half the spacing. B(l) is the a-priori bound over right
// triangles of hypotenuse l, S the spacing s in metres, delta(v) = h(v) - mean of its two ends.
//
// If samples refine the triangles in question to right triangles of hypotenuse l, then the true
// surface leaves the triangles by at most the largest deviation of a sample, plus B(l): refined and
// coarse interpolant are both linear on each refined triangle. With that:
//
//   cap(c) = max |delta| of centre c and of the four midpoints around + B(sqrt2 S)    3 x 3 samples
//   cap(m) = |delta(m)| + B(sqrt2 S)                                                  of spacing s
//   own(v) = largest deviation of samples of spacing s / 2 in the diamond + B(sqrt2 S / 2)
//   e(m) = min(B(2 S),       cap(m), max(own(m), cap(children of m)))
//   e(c) = min(B(2 sqrt2 S), cap(c), max(own(c), e(children of c)))
//
// Valid: each argument of min is. Nested, midpoint m below centre c: B(2 sqrt2 S) >= B(2 S),
// cap(c) >= cap(m), and the third holds e(m) itself. Centre c' of spacing s / 2 below m:
// e(c') <= B(sqrt2 S) <= min(B(2 S), cap(m)), and e(c') <= cap(c') <= the third. Every step is monotone
// in floating point too, and both levels compute B and cap of a vertex from the same numbers by the
// same operations, so the rounded bounds are nested exactly.
//
// A child centre of spacing s / 2 is the middle of a cell of side s, with the cell's own diagonal:
// the bound of a cell is min(B(sqrt2 S), cap(its middle)).
#include "mesh_bounds.h"

#include "fractal_bounds.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace terrane {
namespace {

/// Rounded up.
constexpr double kSqrt2 = 1.4142135623730952;

/// Samples at half the step, seen from one of them.
class Stencil {
public:
    Stencil(const double* here, std::ptrdiff_t row) : here_(here), row_(row) {}

    double operator()(std::ptrdiff_t x, std::ptrdiff_t y) const { return here_[y * row_ + x]; }

    /// How far a sample is from the middle of two others.
    double off_middle(std::ptrdiff_t x, std::ptrdiff_t y, std::ptrdiff_t to_x,
                      std::ptrdiff_t to_y) const {
        const Stencil& h = *this;
        return std::abs(h(x, y) - 0.5 * (h(x - to_x, y - to_y) + h(x + to_x, y + to_y)));
    }

private:
    const double* here_;
    std::ptrdiff_t row_;
};

/// Largest deviation of the 3 x 3 samples of a square from its two triangles.
///
/// @param h      seen from the square's middle
/// @param half   half the square's side, in samples
/// @param north_east  whether its diagonal goes to the north-east
double square_deviation(const Stencil& h, std::ptrdiff_t half, bool north_east) {
    const double across = h.off_middle(0, 0, half, north_east ? half : -half);
    const double south_north =
        std::max(h.off_middle(0, -half, half, 0), h.off_middle(0, half, half, 0));
    const double west_east =
        std::max(h.off_middle(-half, 0, 0, half), h.off_middle(half, 0, 0, half));
    return std::max({across, south_north, west_east});
}

/// Largest deviation of the 5 x 5 samples of a square from its two triangles.
double fine_square_deviation(const Stencil& h, bool north_east) {
    // mirrored where the diagonal goes to the north-west: `toward` 1 is away from the diagonal's foot
    const std::ptrdiff_t toward = north_east ? 1 : -1;
    const double foot = h(-2 * toward, -2);
    const double head = h(2 * toward, 2);
    const double right = h(2 * toward, -2);
    const double left = h(-2 * toward, 2);
    double largest = 0.0;
    for (int y = 0; y <= 4; ++y) {
        for (int x = 0; x <= 4; ++x) {
            const double tx = 0.25 * x, ty = 0.25 * y;
            const double plane = y <= x ? foot + tx * (right - foot) + ty * (head - right)
                                        : foot + ty * (left - foot) + tx * (head - left);
            largest = std::max(largest, std::abs(h((x - 2) * toward, y - 2) - plane));
        }
    }
    return largest;
}

/// Largest deviation of the 13 samples of a midpoint's diamond from its two triangles.
///
/// @param along_x  whether the edge that it splits goes east
double fine_diamond_deviation(const Stencil& h, bool along_x) {
    const std::ptrdiff_t ex = along_x ? 2 : 0, ey = along_x ? 0 : 2;  // to the one end
    const std::ptrdiff_t ux = ex / 2, uy = ey / 2;                    // a step towards it
    const double low = h(-ex, -ey), high = h(ex, ey);
    const double mean = 0.5 * (low + high);
    double largest = std::abs(h(0, 0) - mean);
    largest = std::max(largest, std::abs(h(-ux, -uy) - (0.75 * low + 0.25 * high)));
    largest = std::max(largest, std::abs(h(ux, uy) - (0.25 * low + 0.75 * high)));
    for (const std::ptrdiff_t side : {-1, 1}) {
        const std::ptrdiff_t ax = side * uy, ay = side * ux;  // a step to the apex
        const double apex = h(2 * ax, 2 * ay);
        largest = std::max(largest, std::abs(h(ax, ay) - 0.5 * (mean + apex)));
        largest = std::max(largest, std::abs(h(ax - ux, ay - uy) - 0.5 * (low + apex)));
        largest = std::max(largest, std::abs(h(ax + ux, ay + uy) - 0.5 * (high + apex)));
    }
    return largest;
}

/// Samples of a grid whose sides are made up to whole cells of twice the step.
int whole(int samples) { return samples | 1; }

SampleGrid support(const SampleGrid& grid, int columns, int rows, int margin_cells) {
    SampleGrid fine;
    fine.step = grid.step;
    fine.corner = {2 * grid.corner.x - 2 * margin_cells * grid.step,
                   2 * grid.corner.y - 2 * margin_cells * grid.step};
    fine.columns = 2 * (columns - 1 + 2 * margin_cells) + 1;
    fine.rows = 2 * (rows - 1 + 2 * margin_cells) + 1;
    return fine;
}

/// cap() of the middles of the cells of side s.
///
/// @param heights      of the cells' corners, sides and middles
/// @param first_column, first_row  of the cells, in units of s
std::vector<double> cell_caps(std::span<const double> heights, std::int64_t first_column,
                              std::int64_t first_row, int columns, int rows, double half_cell) {
    const std::ptrdiff_t stride = 2 * columns + 1;
    std::vector<double> caps;
    caps.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const Stencil h(heights.data() + (2 * row + 1) * stride + 2 * column + 1, stride);
            const bool north_east = cut_to_north_east(first_column + column, first_row + row);
            caps.push_back(square_deviation(h, 1, north_east) + half_cell);
        }
    }
    return caps;
}

}  // namespace

float round_up(double bound) {
    const float nearest = static_cast<float>(bound);
    if (static_cast<double>(nearest) >= bound) return nearest;
    return std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

SpacingBounds SpacingBounds::make(const FractalBounds& fractal, double spacing) {
    // products with powers of two are exact: neighbouring levels pass the same hypotenuse
    return {fractal.interpolation(kSqrt2 * (2.0 * spacing)), fractal.interpolation(2.0 * spacing),
            fractal.interpolation(kSqrt2 * spacing),
            fractal.interpolation(kSqrt2 * (0.5 * spacing))};
}

SampleGrid vertex_support(const SampleGrid& grid) {
    return support(grid, whole(grid.columns), whole(grid.rows), 1);
}

SampleGrid cell_support(const SampleGrid& grid) {
    return support(grid, grid.columns, grid.rows, 0);
}

void compute_vertex_bounds(const SampleGrid& grid, std::span<const double> heights,
                           const SpacingBounds& bounds, std::span<float> bounds_out) {
    TERRANE_ASSERT(grid.corner.x % (2 * grid.step) == 0 && grid.corner.y % (2 * grid.step) == 0,
                   "the corner must be a multiple of twice the step");
    const int columns = whole(grid.columns), rows = whole(grid.rows);
    const SampleGrid fine = vertex_support(grid);
    const std::ptrdiff_t stride = fine.columns;
    const auto at = [&](int column, int row) {  // a sample of the grid, past the margin
        return Stencil(heights.data() + 2 * (row + 1) * stride + 2 * (column + 1), stride);
    };

    // the cells of side s, with a margin of one: their middles are the midpoints' children
    const std::int64_t first_column = grid.corner.x / grid.step - 1;
    const std::int64_t first_row = grid.corner.y / grid.step - 1;
    const std::vector<double> caps =
        cell_caps(heights, first_column, first_row, columns + 1, rows + 1, bounds.half_cell);
    const auto cap = [&](int column, int row) {  // of the cell north-east of a sample, or -1
        return caps[static_cast<std::size_t>((row + 1) * (columns + 1) + column + 1)];
    };

    std::vector<double> midpoints(static_cast<std::size_t>(columns) *
                                  static_cast<std::size_t>(rows));
    const auto midpoint = [&](int column, int row) -> double& {
        return midpoints[static_cast<std::size_t>(row * columns + column)];
    };
    for (int row = 0; row < rows; ++row) {
        for (int column = 1 - (row & 1); column < columns; column += 2) {
            const Stencil h = at(column, row);
            const bool along_x = (column & 1) != 0;
            const double delta = h.off_middle(0, 0, along_x ? 2 : 0, along_x ? 0 : 2);
            const double own = fine_diamond_deviation(h, along_x) + bounds.half_cell;
            const double below = std::max({own, cap(column - 1, row - 1), cap(column, row - 1),
                                           cap(column - 1, row), cap(column, row)});
            midpoint(column, row) = std::min({bounds.midpoint, delta + bounds.cell, below});
        }
    }

    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            double bound = 0.0;
            if ((column & 1) != (row & 1)) {
                bound = midpoint(column, row);
            } else if ((column & row & 1) != 0) {
                const Stencil h = at(column, row);
                const bool north_east =
                    cut_to_north_east((first_column + column) / 2, (first_row + row) / 2);
                const double own = fine_square_deviation(h, north_east) + bounds.half_cell;
                const double below =
                    std::max({own, midpoint(column - 1, row), midpoint(column + 1, row),
                              midpoint(column, row - 1), midpoint(column, row + 1)});
                bound = std::min(
                    {bounds.centre, square_deviation(h, 2, north_east) + bounds.cell, below});
            }
            bounds_out[static_cast<std::size_t>(row * grid.columns + column)] = round_up(bound);
        }
    }
}

void compute_cell_bounds(const SampleGrid& grid, std::span<const double> heights,
                         const SpacingBounds& bounds, std::span<float> bounds_out) {
    const std::vector<double> caps =
        cell_caps(heights, grid.corner.x / grid.step, grid.corner.y / grid.step, grid.columns - 1,
                  grid.rows - 1, bounds.half_cell);
    std::ranges::transform(caps, bounds_out.begin(),
                           [&](double cap) { return round_up(std::min(bounds.cell, cap)); });
}

}  // namespace terrane
