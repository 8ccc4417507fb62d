// SPDX-License-Identifier: MIT
#include "source/mesh_bounds.h"

#include "base/simd_level.h"
#include "source/cell_deviation.h"

#include <terrane/base/result.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

/// Rows of numbers. Each row is stored as kParts runs: run k has the columns k, k + kParts, ... Runs are padded, so
/// that a group of cells may be read past their end.
template <unsigned kParts>
class SplitRows {
public:
    SplitRows(int columns, int rows)
        : width_(static_cast<std::size_t>(columns) / kParts + 1 + internal::kCellGroup),
          values_(width_ * kParts * static_cast<std::size_t>(rows)) {}

    /// The values of columns `column`, `column + kParts`, ... of a row.
    double* from(int column, int row) {
        const auto at = static_cast<unsigned>(column);
        return &values_[(static_cast<std::size_t>(row) * kParts + at % kParts) * width_ +
                        at / kParts];
    }
    double& at(int column, int row) { return *from(column, row); }

    void assign(int row, std::span<const double> values) {
        for (unsigned part = 0; part < kParts; ++part) {
            double* const out = from(static_cast<int>(part), row);
            for (std::size_t i = 0, k = part; k < values.size(); ++i, k += kParts) {
                out[i] = values[k];
            }
        }
    }

    /// Copies the last row to the first.
    void copy_last_row() {
        const auto row = static_cast<std::ptrdiff_t>(kParts * width_);
        std::copy_n(values_.end() - row, row, values_.begin());
    }

private:
    std::size_t width_;
    std::vector<double> values_;
};

// Computes the bound e(v) of a vertex v over its diamond from samples at a quarter of the spacing s. The bounds depend
// on the address alone. B is the a-priori bound over right triangles, by their hypotenuse.
//
// The samples divide all these triangles into right triangles with hypotenuse sqrt2 s / 4. A sample has a centre C and
// a radius R: the true height is within C +- R at the samples, and between them within the interpolation of C +- R,
// widened by an error F. So over one fine triangle with corners v_i, for p = sum w_i v_i and a plane P,
//
//   |h(p) - P(p)| <= |sum w_i C(v_i) - P(p)| + sum w_i R(v_i) + F
//                 <= max (|C(v_i) - P(v_i)| + R(v_i)) + F,   because P is linear.
//
// own() is the largest such bound over the samples in a set of triangles. If an octave is so fine that its samples say
// little about the surface between them, it is omitted from C, and its supremum is added to R: this gives a better
// bound and saves samples (FractalBounds::head()). The bounds are
//
//   e(cell) = min(B(sqrt2 s),   own(cell))
//   e(m)    = min(B(2 s),       max(own(m), own(the four cells around m)))
//   e(c)    = min(B(2 sqrt2 s), max(own(c), e(the four midpoints around c)))
//
// The four cells around m are the diamonds of its children. The bound of a midpoint therefore never exceeds that of its
// centre; the bound of a centre of spacing s / 2, from finer samples, rarely exceeds that of its parent.

namespace {

/// Number of steps of the fine samples per step of the grid.
constexpr int kFine = internal::kCellSamples - 1;

bool odd(std::int64_t value) { return (value & 1) != 0; }

using FineRows = SplitRows<2 * kFine>;

/// The cells that contribute to the bounds of a grid. Their number along each axis is even. The first column and row,
/// counted in steps of the grid, have odd indices.
class Frame {
public:
    Frame(const SampleGrid& grid, bool with_vertices)
        : step_(grid.step),
          first_x_(first(grid.corner.x, with_vertices)),
          first_y_(first(grid.corner.y, with_vertices)),
          columns_(cells(grid.corner.x, first_x_, grid.columns, with_vertices)),
          rows_(cells(grid.corner.y, first_y_, grid.rows, with_vertices)),
          heights_(columns_ + 1, rows_ + 1),
          rises_(columns_ + 1, rows_ + 1),
          vertices_(columns_ + 1, rows_ + 1),
          cells_(columns_, rows_) {}

    void measure(const MeshSamples& samples) {
        read_heights(samples);
        constexpr int kBand = 8;  // rows of cells whose samples stay in the cache
        FineRows centres(kFine * columns_ + 1, kFine * kBand + 1);
        FineRows radii(samples.has_radii ? kFine * columns_ + 1 : 0, kFine * kBand + 1);
        for (int row = 0; row < rows_; row += kBand) {
            const int count = std::min(kBand, rows_ - row);
            read_samples(samples, row, count, centres, radii);
            for (int i = 0; i < count; ++i) {
                for (const int side : {0, 1}) {
                    measure_cells(row + i, side, kFine * i, centres, radii, samples.has_radii);
                }
            }
        }
    }

    /// Turns the measured deviations of vertices into bounds.
    void finish(const SpacingBounds& bounds);

    /// Measured deviation of the cell to the north-east of a lattice point with indices in units of the grid's step.
    double cell(std::int64_t x, std::int64_t y) {
        return cells_.at(static_cast<int>(x - first_x_), static_cast<int>(y - first_y_));
    }
    /// Bound of a vertex of the grid's spacing, with indices in units of the grid's step.
    double vertex(std::int64_t x, std::int64_t y) {
        return vertices_.at(static_cast<int>(x - first_x_), static_cast<int>(y - first_y_));
    }

private:
    std::int64_t first(std::int64_t corner, bool with_vertices) const {
        const std::int64_t index = corner / step_ - (with_vertices ? 1 : 0);
        return odd(index) ? index : index - 1;
    }
    int cells(std::int64_t corner, std::int64_t first, int samples, bool with_vertices) const {
        // the last centre needs one more midpoint, which needs one more cell
        const int last = with_vertices ? samples | 1 : samples - 1;
        const int count = static_cast<int>(corner / step_ - first) + last;
        return count + (count & 1);
    }

    void read_heights(const MeshSamples& samples);
    double rise(int column, int row);
    void read_samples(const MeshSamples& samples, int row, int count, FineRows& centres,
                      FineRows& radii);
    void measure_cells(int row, int side, int fine_row, FineRows& centres, FineRows& radii,
                       bool has_radii);

    std::int64_t step_, first_x_, first_y_;
    int columns_, rows_;  ///< number of cells
    SplitRows<2> heights_, rises_, vertices_, cells_;
    std::vector<double> buffer_, radius_buffer_;
    internal::FindMaxDeviations raise_ = internal::find_max_deviations(internal::best_simd_level());
};

void Frame::read_heights(const MeshSamples& samples) {
    const SampleGrid grid{{first_x_ * step_, first_y_ * step_}, step_, columns_ + 1, rows_ + 1};
    buffer_.resize(grid.size());
    samples.heights(grid, buffer_);
    const auto width = static_cast<std::size_t>(grid.columns);
    for (int row = 0; row < grid.rows; ++row) {
        heights_.assign(row,
                        std::span(buffer_).subspan(static_cast<std::size_t>(row) * width, width));
    }
    for (int row = 1; row < rows_; ++row) {
        for (int column = 1; column < columns_; ++column) {
            rises_.at(column, row) = rise(column, row);
        }
    }
}

/// Height of a vertex above the mean height of its two ends; 0 for a vertex of a coarser spacing.
double Frame::rise(int column, int row) {
    const std::int64_t x = first_x_ + column, y = first_y_ + row;
    int to_x = odd(x) ? 1 : 0;
    const int to_y = odd(y) ? 1 : 0;
    if (odd(x) && odd(y) && !cut_to_north_east((x - 1) / 2, (y - 1) / 2)) to_x = -1;
    return heights_.at(column, row) -
           0.5 * (heights_.at(column - to_x, row - to_y) + heights_.at(column + to_x, row + to_y));
}

/// Reads the samples of `count` rows of cells. Rows must be read in order, because the southernmost samples are copied
/// from the northernmost ones of the previous call.
void Frame::read_samples(const MeshSamples& samples, int row, int count, FineRows& centres,
                         FineRows& radii) {
    const int known = row > 0 ? 1 : 0;
    SampleGrid grid;
    grid.step = step_;  // in quarters of the finest spacing
    grid.corner = {kFine * first_x_ * step_, (kFine * (first_y_ + row) + known) * step_};
    grid.columns = kFine * columns_ + 1;
    grid.rows = kFine * count + 1 - known;
    buffer_.resize(grid.size());
    radius_buffer_.resize(samples.has_radii ? grid.size() : 0);
    samples.fine(grid, buffer_, radius_buffer_);
    const auto width = static_cast<std::size_t>(grid.columns);
    if (known != 0) {
        centres.copy_last_row();
        if (samples.has_radii) radii.copy_last_row();
    }
    for (int i = 0; i < grid.rows; ++i) {
        const std::size_t begin = static_cast<std::size_t>(i) * width;
        centres.assign(i + known, std::span(buffer_).subspan(begin, width));
        if (samples.has_radii) {
            radii.assign(i + known, std::span(radius_buffer_).subspan(begin, width));
        }
    }
}

/// Measures every other cell of a row, starting with the first or the second one.
void Frame::measure_cells(int row, int side, int fine_row, FineRows& centres, FineRows& radii,
                          bool has_radii) {
    const std::int64_t x = first_x_ + side, y = first_y_ + row;
    const bool mirrored = !cut_to_north_east(x, y);
    const int foot = mirrored ? side + 1 : side, head = mirrored ? side : side + 1;
    internal::CellRow cells;
    constexpr int kGroup = internal::kCellGroup;
    cells.count = (columns_ / 2 + kGroup - 1) / kGroup * kGroup;
    cells.has_radii = has_radii;
    for (int i = 0; i < internal::kCellSamples; ++i) {
        for (int j = 0; j < internal::kCellSamples; ++j) {
            const int column = kFine * side + (mirrored ? kFine - j : j);
            cells.centres[i][j] = centres.from(column, fine_row + i);
            cells.radii[i][j] = has_radii ? radii.from(column, fine_row + i) : nullptr;
        }
    }
    cells.foot = heights_.from(foot, row);
    cells.right = heights_.from(head, row);
    cells.head = heights_.from(head, row + 1);
    cells.left = heights_.from(foot, row + 1);
    cells.right_rise = rises_.from(head, row);
    cells.left_rise = rises_.from(foot, row + 1);
    cells.right_most = vertices_.from(head, row);
    cells.left_most = vertices_.from(foot, row + 1);
    cells.centre_is_foot = odd(first_x_ + foot) && odd(y);
    const int centre = cells.centre_is_foot ? foot : head;
    const int centre_row = cells.centre_is_foot ? row : row + 1;
    cells.centre_rise = rises_.from(centre, centre_row);
    cells.centre_most = vertices_.from(centre, centre_row);
    cells.cell = cells_.from(side, row);
    raise_(cells);
}

void Frame::finish(const SpacingBounds& bounds) {
    for (int row = 1; row < rows_; ++row) {
        // one of a midpoint's two indices is odd
        for (int column = odd(first_x_ + first_y_ + row) ? 2 : 1; column < columns_; column += 2) {
            double& own = vertices_.at(column, row);
            own = std::max({own, cells_.at(column - 1, row - 1), cells_.at(column, row - 1),
                            cells_.at(column - 1, row), cells_.at(column, row)});
            own = std::min(bounds.midpoint, own + bounds.fine);
        }
    }
    for (int row = 2; row < rows_ - 1; row += 2) {  // the first row and column have odd indices
        for (int column = 2; column < columns_ - 1; column += 2) {
            double& own = vertices_.at(column, row);
            own = std::max({own + bounds.fine, vertices_.at(column - 1, row),
                            vertices_.at(column + 1, row), vertices_.at(column, row - 1),
                            vertices_.at(column, row + 1)});
            own = std::min(bounds.centre, own);
        }
    }
}

}  // namespace

float round_up(double bound) {
    const float nearest = static_cast<float>(bound);
    // branch-free, because a branch would be unpredictable; incrementing the bits gives the next float, because bounds
    // are not negative
    const std::uint32_t further = static_cast<double>(nearest) < bound ? 1 : 0;
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + further);
}

void compute_mesh_bounds(const SampleGrid& grid, const MeshSamples& samples,
                         const SpacingBounds& bounds, std::span<float> vertex_bounds_out,
                         std::span<float> cell_bounds_out) {
    const bool with_vertices = !vertex_bounds_out.empty();
    TERRANE_ASSERT(!with_vertices || (grid.corner.x % (2 * grid.step) == 0 &&
                                      grid.corner.y % (2 * grid.step) == 0),
                   "the corner must be a multiple of twice the step");
    Frame frame(grid, with_vertices);
    frame.measure(samples);
    if (with_vertices) frame.finish(bounds);
    const std::int64_t west = grid.corner.x / grid.step, south = grid.corner.y / grid.step;

    for (int row = 0; with_vertices && row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const bool coarser = ((row | column) & 1) == 0;
            vertex_bounds_out[static_cast<std::size_t>(row * grid.columns + column)] =
                coarser ? 0.0f : round_up(frame.vertex(west + column, south + row));
        }
    }
    if (cell_bounds_out.empty()) return;
    std::size_t index = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column) {
            cell_bounds_out[index++] = round_up(
                std::min(bounds.cell, frame.cell(west + column, south + row) + bounds.fine));
        }
    }
}

}  // namespace terrane
