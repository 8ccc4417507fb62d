// SPDX-License-Identifier: MIT
//
// Sources: P. Lindstrom, V. Pascucci, Terrain Simplification Simplified: A General Framework for
//          View-Dependent Out-of-Core Visualization, IEEE TVCG 8(3), 2002: nested bounds over the
//          4-8 mesh.
// Deviations: the bound of a vertex is the deviation of the surface itself from the vertex's two triangles, found over
//          all lattice points in them, instead of the height differences of single splits.
#include "bilinear/diamond_window.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

/// Range of surface minus plane over a triangle.
///
/// In a cell inside the triangle, a bilinear surface minus a plane is extreme at the corners. In a cell that the
/// hypotenuse cuts from corner to corner, it is extreme at the three corners inside, or on the hypotenuse, where it is
/// a parabola.
void add_triangle(const DiamondWindow& window, const RightTriangle& t, Range& range) {
    if (window.kinked) {
        window.kinked->add_triangle(t, range);
        return;
    }
    const double slope_x = (t.at_x_end - t.at_corner) / t.leg;
    const double slope_y = (t.at_y_end - t.at_corner) / t.leg;
    const double* corner = window.heights.data() + window.at(t.x, t.y);
    const std::ptrdiff_t stride_y = static_cast<std::ptrdiff_t>(t.sign_y) * window.columns;

    // Over equal rows, a plane that is level along y leaves the same differences in every row. The hypotenuse adds
    // nothing to them: as 2 a is a number, a + b is rounded by at most |b - a|, so that its bow is at most its rise.
    if (slope_y == 0.0 && window.has_equal_rows(std::min(t.y, t.y + t.sign_y * t.leg),
                                                std::max(t.y, t.y + t.sign_y * t.leg))) {
        for (int i = 0; i <= t.leg; ++i) {
            range.add(corner[i * t.sign_x] - (t.at_corner + i * slope_x));
        }
        return;
    }
    if (slope_x == 0.0 && window.has_equal_columns(std::min(t.x, t.x + t.sign_x * t.leg),
                                                   std::max(t.x, t.x + t.sign_x * t.leg))) {
        for (int j = 0; j <= t.leg; ++j) {
            range.add(corner[j * stride_y] - (t.at_corner + j * slope_y));
        }
        return;
    }

    // Two rows of differences; not initialised, because most triangles are small.
    std::array<double, kMaxLeg + 2> first_row, second_row;
    double* here = first_row.data();
    double* above = second_row.data();
    const auto differences = [&](int j, int count, double* out) {
        const double* row = corner + j * stride_y;
        const double base = t.at_corner + j * slope_y;
        for (int i = 0; i < count; ++i) out[i] = row[i * t.sign_x] - (base + i * slope_x);
    };
    differences(0, t.leg + 1, here);
    Range odd;  // of every other difference: the processor then compares two at a time
    for (int j = 0; j < t.leg; ++j) {
        const int whole = t.leg - 1 - j;  // cells of this row before the cut one
        differences(j + 1, whole + 2, above);
        Range cut;
        cut.add(here[whole]);
        cut.add(here[whole + 1]);
        cut.add(above[whole]);
        const double bow = here[whole] + above[whole + 1] - here[whole + 1] - above[whole];
        const double across = above[whole] - here[whole + 1];
        if (std::fabs(across) < std::fabs(bow)) {
            cut.add(0.5 * (here[whole + 1] + above[whole]) + 0.25 * bow +
                    across * across / (4.0 * bow));
        }
        range.add(cut);
        int i = 0;
        for (; i + 1 < whole; i += 2) {
            range.add(here[i]);
            odd.add(here[i + 1]);
        }
        if (i < whole) range.add(here[i]);
        std::swap(here, above);
    }
    range.add(here[0]);
    range.add(odd);
}

/// Whether the square of side n at a point is cut from south-west to north-east.
bool is_cut_north_east(const DiamondWindow& window, int x, int y, int n) {
    // Exact: the corners of squares are multiples of their side.
    return (((window.first_x + x) / n + (window.first_y + y) / n) & 1) == 0;
}

/// The quarters of the two triangles that share an edge: four right triangles around its midpoint, with legs of n.
std::array<TriangleShape, 4> quarters_of_edge(int n, bool along_x) {
    const CornerHeight middle = along_x ? CornerHeight::mean_x : CornerHeight::mean_y;
    return {{{0, 0, 1, 1, n, middle},
             {0, 0, -1, 1, n, middle},
             {0, 0, -1, -1, n, middle},
             {0, 0, 1, -1, n, middle}}};
}

/// The triangles of a square of side n, relative to its south-western corner.
std::array<TriangleShape, 2> halves_of_square(int n, bool cut_north_east) {
    if (cut_north_east) return {{{n, 0, -1, 1, n}, {0, n, 1, -1, n}}};
    return {{{0, 0, 1, 1, n}, {n, n, -1, -1, n}}};
}

/// The triangle of a shape at a point.
RightTriangle triangle_at(const DiamondWindow& window, int x, int y, const TriangleShape& shape) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    x += shape.x;
    y += shape.y;
    const int n = shape.leg;
    const double middle =
        shape.corner == CornerHeight::mean_x   ? 0.5 * (height(x - n, y) + height(x + n, y))
        : shape.corner == CornerHeight::mean_y ? 0.5 * (height(x, y - n) + height(x, y + n))
                                               : height(x, y);
    return {x,
            y,
            shape.sign_x,
            shape.sign_y,
            n,
            middle,
            height(x + shape.sign_x * n, y),
            height(x, y + shape.sign_y * n)};
}

float largest_deviation(const DiamondWindow& window, int x, int y,
                        std::span<const TriangleShape> shapes) {
    Range range;
    for (const TriangleShape& shape : shapes) {
        add_triangle(window, triangle_at(window, x, y, shape), range);
    }
    return round_outward(range.deviation());
}

float largest_around(const DiamondWindow& window, int x, int y, int n) {
    if (n > 1) {
        const int half = n / 2;
        return std::max(std::max(window.bounds[window.at(x - half, y - half)],
                                 window.bounds[window.at(x + half, y - half)]),
                        std::max(window.bounds[window.at(x - half, y + half)],
                                 window.bounds[window.at(x + half, y + half)]));
    }
    if (window.middle_bounds.empty()) return 0.0f;
    return std::max(std::max(window.middle_bounds[window.cell_at(x - 1, y - 1)],
                             window.middle_bounds[window.cell_at(x, y - 1)]),
                    std::max(window.middle_bounds[window.cell_at(x - 1, y)],
                             window.middle_bounds[window.cell_at(x, y)]));
}

/// The smallest window coordinate >= n whose lattice index is an even multiple of n, or with `odd` an odd one.
int first_multiple(std::int64_t first_index, int n, bool odd) {
    const std::int64_t side = 2 * static_cast<std::int64_t>(n);
    const std::int64_t wanted = odd ? n : 0;
    const std::int64_t rest = (first_index + n - wanted) % side;
    return n + static_cast<int>(rest == 0 ? 0 : (rest > 0 ? side - rest : -rest));
}

}  // namespace

float round_outward(double deviation) {
    if (!(deviation > 0.0)) return 0.0f;
    constexpr double kRounding = 1e-9;
    const double wanted = deviation + kRounding;
    const float nearest = static_cast<float>(wanted);
    if (static_cast<double>(nearest) >= wanted) return nearest;
    // The next larger float.
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + 1u);
}

float cell_deviation(const DiamondWindow& window, int x, int y, int n) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    if (n == 1 && !window.kinked) {
        return round_outward(0.25 * std::fabs(height(x, y) - height(x + n, y) - height(x, y + n) +
                                              height(x + n, y + n)));
    }
    return largest_deviation(window, x, y, halves_of_square(n, is_cut_north_east(window, x, y, n)));
}

DeviationRows::DeviationRows(const DiamondWindow& window)
    : window_(window), find_deviations_(find_triangle_deviations(best_simd_level())) {}

void DeviationRows::arrange(int log2_stride) {
    if (heights_.values != nullptr && heights_.log2_stride == log2_stride) return;
    const int stride = 1 << log2_stride;
    const int points = (window_.columns + stride - 1) >> log2_stride;
    heights_.log2_stride = log2_stride;
    heights_.pitch = static_cast<std::size_t>(points + kPhasePadding);
    values_.resize(static_cast<std::size_t>(window_.rows) * static_cast<std::size_t>(stride) *
                   heights_.pitch);
    heights_.values = values_.data();
    double* out = values_.data();
    for (int y = 0; y < window_.rows; ++y) {
        const double* const row = window_.heights.data() + window_.at(0, y);
        for (int phase = 0; phase < stride; ++phase, out += heights_.pitch) {
            std::size_t i = 0;
            for (int x = phase; x < window_.columns; x += stride) out[i++] = row[x];
        }
    }
}

template <class Compute>
void DeviationRows::skip_equal_columns(int x, int step, int before, int after,
                                       std::span<float> deviations_out, const Compute& compute) {
    const int count = static_cast<int>(deviations_out.size());
    const auto repeats = [&](int k) {
        return k > 0 && window_.has_equal_columns(x + k * step - before, x + k * step + after);
    };
    for (int k = 0; k < count;) {
        if (repeats(k)) {
            const auto at = static_cast<std::size_t>(k++);
            deviations_out[at] = deviations_out[at - 1];
            continue;
        }
        const int first = k++;
        while (k < count && !repeats(k)) ++k;
        compute(first, deviations_out.subspan(static_cast<std::size_t>(first),
                                              static_cast<std::size_t>(k - first)));
    }
}

void DeviationRows::edges(int x, int y, int n, bool along_x, std::span<float> deviations_out) {
    const std::array<TriangleShape, 4> shapes = quarters_of_edge(n, along_x);
    if (window_.kinked) {
        for (float& deviation : deviations_out) {
            deviation = largest_deviation(window_, x, y, shapes);
            x += 2 * n;
        }
        return;
    }
    arrange(std::countr_zero(static_cast<unsigned>(2 * n)));
    skip_equal_columns(x, 2 * n, 3 * n, n, deviations_out, [&](int first, std::span<float> out) {
        find_deviations_(heights_, shapes.data(), 4, x + 2 * n * first, y,
                         static_cast<int>(out.size()), out.data());
    });
}

void DeviationRows::squares(int x, int y, int n, std::span<float> deviations_out) {
    if (window_.kinked || n == 1) {
        for (float& deviation : deviations_out) {
            deviation = cell_deviation(window_, x, y, n);
            x += n;
        }
        return;
    }
    arrange(std::countr_zero(static_cast<unsigned>(2 * n)));
    skip_equal_columns(x, n, n, n, deviations_out, [&](int first, std::span<float> out) {
        // Neighbours are cut along different diagonals.
        for (const int begin : {0, 1}) {
            const int count = (static_cast<int>(out.size()) + 1 - begin) / 2;
            const int west = x + (first + begin) * n;
            const auto shapes = halves_of_square(n, is_cut_north_east(window_, west, y, n));
            every_other_.resize(static_cast<std::size_t>(count));
            find_deviations_(heights_, shapes.data(), 2, west, y, count, every_other_.data());
            for (int k = 0; k < count; ++k) {
                out[static_cast<std::size_t>(begin + 2 * k)] =
                    every_other_[static_cast<std::size_t>(k)];
            }
        }
    });
}

void add_triangle_part(const DiamondWindow& window, const RightTriangle& t, Range& range) {
    if (window.kinked) {
        window.kinked->add_part(t, range);
    } else {
        add_triangle(window, t, range);
    }
}

void add_square(const DiamondWindow& window, int x, int y, int n, double at_corner, double at_x_end,
                double at_y_end, Range& range) {
    if (window.kinked) {
        window.kinked->add_square(x, y, n, at_corner, at_x_end, at_y_end, range);
        return;
    }
    const double slope_x = (at_x_end - at_corner) / n, slope_y = (at_y_end - at_corner) / n;
    for (int j = 0; j <= n; ++j) {
        const double* row = window.heights.data() + window.at(x, y + j);
        const double base = at_corner + j * slope_y;
        for (int i = 0; i <= n; ++i) range.add(row[i] - (base + i * slope_x));
    }
}

HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n) {
    if (window.kinked) {
        const Range range = window.kinked->bilinear_deviation(x, y, n);
        return {range.low, range.high};
    }
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    const double south_west = height(x, y), south_east = height(x + n, y);
    const double north_west = height(x, y + n), north_east = height(x + n, y + n);
    const auto difference = [&](int i, int j) {
        const double fx = static_cast<double>(i) / n, fy = static_cast<double>(j) / n;
        const double south = south_west + fx * (south_east - south_west);
        const double north = north_west + fx * (north_east - north_west);
        return height(x + i, y + j) - (south + fy * (north - south));
    };
    Range range;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) range.add(difference(i, j));
    }
    return {range.low, range.high};
}

void DiamondWindow::find_runs() {
    const auto width = static_cast<std::size_t>(columns);
    const double* row = heights.data();
    row_runs.assign(static_cast<std::size_t>(rows), 0);
    for (std::size_t y = 1; y < row_runs.size(); ++y, row += width) {
        const bool is_equal = std::memcmp(row, row + width, width * sizeof(double)) == 0;
        row_runs[y] = is_equal ? row_runs[y - 1] : static_cast<int>(y);
    }
    // The columns that equal their western neighbours in all rows so far.
    std::vector<int> equal(width - 1);
    std::iota(equal.begin(), equal.end(), 1);
    row = heights.data();
    for (int y = 0; y < rows && !equal.empty(); ++y, row += width) {
        if (y > 0 && row_runs[static_cast<std::size_t>(y)] < y) continue;
        std::erase_if(equal, [row](int x) { return row[x] != row[x - 1]; });
    }
    column_runs.resize(width);
    std::iota(column_runs.begin(), column_runs.end(), 0);
    for (const int x : equal) {
        column_runs[static_cast<std::size_t>(x)] = column_runs[static_cast<std::size_t>(x) - 1];
    }
}

// Deviations repeat over equal rows, and over equal columns: a vertex has the deviation of its neighbour of the same
// kind, 2 n away, because the same heights enter the same operations. This includes cells, although neighbours are cut
// along different diagonals. Over equal rows both planes of a cell are level along y; one starts from the eastern
// corner, the other one from the western corner, whichever diagonal divides them. Bounds repeat where the rows around
// the descendants of both vertices, up to 3 n away, are equal too.
void compute_bounds(DiamondWindow& window, int last_n) {
    window.bounds.resize(window.heights.size(), 0.0f);
    DeviationRows rows(window);
    std::vector<float> deviations;
    const auto for_each_vertex = [&](int n, bool odd_x, bool odd_y, auto&& find_deviations,
                                     auto&& below_at) {
        const int first_x = first_multiple(window.first_x, n, odd_x);
        const int first_y = first_multiple(window.first_y, n, odd_y);
        const int count = std::max(0, (window.columns - 1 - n - first_x + 2 * n) / (2 * n));
        deviations.resize(static_cast<std::size_t>(count));
        for (int y = first_y; y + n < window.rows; y += 2 * n) {
            const bool repeats_row = y > first_y && window.has_equal_rows(y - 3 * n, y + n);
            const bool repeats_bounds = y >= 5 * n && y + 3 * n < window.rows &&
                                        window.has_equal_rows(y - 5 * n, y + 3 * n);
            if (!repeats_row && !repeats_bounds) find_deviations(first_x, y);
            int x = first_x;
            for (const float deviation : deviations) {
                float& bound = window.bounds[window.at(x, y)];
                bound = repeats_bounds ? window.bounds[window.at(x, y - 2 * n)]
                                       : std::max(deviation, below_at(x, y));
                x += 2 * n;
            }
        }
    };
    for (int n = 1; n <= last_n; n *= 2) {
        if (window.kinked) {
            window.kinked->keep_diagonals(n);
            window.kinked->keep_diagonals(2 * n);
        }
        // Midpoints first: they are the centres' children.
        for (const bool along_x : {true, false}) {
            for_each_vertex(
                n, along_x, !along_x,
                [&](int x, int y) { rows.edges(x, y, n, along_x, deviations); },
                [&](int x, int y) { return largest_around(window, x, y, n); });
        }
        for_each_vertex(
            n, true, true, [&](int x, int y) { rows.squares(x - n, y - n, 2 * n, deviations); },
            [&](int x, int y) {
                return std::max(std::max(window.bounds[window.at(x - n, y)],
                                         window.bounds[window.at(x + n, y)]),
                                std::max(window.bounds[window.at(x, y - n)],
                                         window.bounds[window.at(x, y + n)]));
            });
    }
}

}  // namespace terrane::internal
