// SPDX-License-Identifier: MIT
//
// Sources: P. Lindstrom, V. Pascucci, Terrain Simplification Simplified: A General Framework for
//          View-Dependent Out-of-Core Visualization, IEEE TVCG 8(3), 2002: nested bounds over the
//          4-8 mesh.
// Deviations: a vertex carries the deviation of the surface itself from its two triangles, found
//          over every lattice point below, instead of the height differences of single splits.
#include "surface/diamond_window.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace terrane::internal {
namespace {

/// Longest leg of a triangle, in cells.
constexpr int kMaxLeg = 128;

/// Range of surface minus plane over a triangle.
///
/// A cell inside: the surface's bilinear part minus a plane is extreme at the cell's corners. A cell
/// that the hypotenuse cuts from corner to corner: at its three corners inside, or on the hypotenuse,
/// where it is a parabola.
void add_triangle(const DiamondWindow& window, const RightTriangle& t, Range& range) {
    if (window.kinked) {
        window.kinked->add_triangle(t, range);
        return;
    }
    const double slope_x = (t.at_x_end - t.at_corner) / t.leg;
    const double slope_y = (t.at_y_end - t.at_corner) / t.leg;
    const double* corner = window.heights.data() + window.at(t.x, t.y);
    const std::ptrdiff_t stride_y = static_cast<std::ptrdiff_t>(t.sign_y) * window.columns;

    // Two rows of differences; uninitialised, because most triangles are small.
    std::array<double, kMaxLeg + 2> first_row, second_row;
    double* here = first_row.data();
    double* above = second_row.data();
    const auto differences = [&](int j, int count, double* out) {
        const double* row = corner + j * stride_y;
        const double base = t.at_corner + j * slope_y;
        for (int i = 0; i < count; ++i) out[i] = row[i * t.sign_x] - (base + i * slope_x);
    };
    differences(0, t.leg + 1, here);
    for (int j = 0; j < t.leg; ++j) {
        const int whole = t.leg - 1 - j;  // cells of this row before the one that is cut
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
        for (int i = 0; i < whole; ++i) range.add(here[i]);
        std::swap(here, above);
    }
    range.add(here[0]);
}

/// The same for legs of one cell, the most frequent case: only the corner leaves the plane, and the hypotenuse bows
/// by a quarter of the cell's twist.
void add_small_triangle(const DiamondWindow& window, const RightTriangle& t, Range& range) {
    const double* corner = window.heights.data() + window.at(t.x, t.y);
    const double* beyond = corner + static_cast<std::ptrdiff_t>(t.sign_y) * window.columns;
    const double difference = *corner - t.at_corner;
    const double bow = 0.25 * (*corner + beyond[t.sign_x] - t.at_x_end - t.at_y_end);
    range.add(std::min(0.0, std::min(difference, bow)));
    range.add(std::max(0.0, std::max(difference, bow)));
}

/// Whether the square of side n at a point is cut from south-west to north-east.
bool is_cut_north_east(const DiamondWindow& window, int x, int y, int n) {
    // Exact: the corners of squares are multiples of their side.
    return (((window.first_x + x) / n + (window.first_y + y) / n) & 1) == 0;
}

/// The two triangles that share the edge from (x - n, y) to (x + n, y), or from (x, y - n) to
/// (x, y + n), as four right triangles around its midpoint.
float edge_deviation(const DiamondWindow& window, int x, int y, int n, bool along_x) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    const double west = height(x - n, y), east = height(x + n, y);
    const double south = height(x, y - n), north = height(x, y + n);
    const double middle = along_x ? 0.5 * (west + east) : 0.5 * (south + north);
    const std::array<RightTriangle, 4> quarters{{{x, y, 1, 1, n, middle, east, north},
                                                 {x, y, -1, 1, n, middle, west, north},
                                                 {x, y, -1, -1, n, middle, west, south},
                                                 {x, y, 1, -1, n, middle, east, south}}};
    Range range;
    for (const RightTriangle& quarter : quarters) {
        if (n == 1 && !window.kinked) {
            add_small_triangle(window, quarter, range);
        } else {
            add_triangle(window, quarter, range);
        }
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

/// The least window coordinate >= n whose index is a multiple of n, of the parity wanted.
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
    // The next float up.
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + 1u);
}

float cell_deviation(const DiamondWindow& window, int x, int y, int n) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    const double south_west = height(x, y), south_east = height(x + n, y);
    const double north_west = height(x, y + n), north_east = height(x + n, y + n);
    if (n == 1 && !window.kinked) {
        return round_outward(0.25 * std::fabs(south_west - south_east - north_west + north_east));
    }
    Range range;
    if (is_cut_north_east(window, x, y, n)) {
        add_triangle(window, {x + n, y, -1, 1, n, south_east, south_west, north_east}, range);
        add_triangle(window, {x, y + n, 1, -1, n, north_west, north_east, south_west}, range);
    } else {
        add_triangle(window, {x, y, 1, 1, n, south_west, south_east, north_west}, range);
        add_triangle(window, {x + n, y + n, -1, -1, n, north_east, north_west, south_east}, range);
    }
    return round_outward(range.deviation());
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

void compute_bounds(DiamondWindow& window, int last_n) {
    window.bounds.resize(window.heights.size(), 0.0f);
    for (int n = 1; n <= last_n; n *= 2) {
        if (window.kinked) {
            window.kinked->keep_diagonals(n);
            window.kinked->keep_diagonals(2 * n);
        }
        // Midpoints first: they are the centres' children.
        for (const bool along_x : {true, false}) {
            for (int y = first_multiple(window.first_y, n, !along_x); y + n < window.rows;
                 y += 2 * n) {
                for (int x = first_multiple(window.first_x, n, along_x); x + n < window.columns;
                     x += 2 * n) {
                    window.bounds[window.at(x, y)] = std::max(
                        edge_deviation(window, x, y, n, along_x), largest_around(window, x, y, n));
                }
            }
        }
        for (int y = first_multiple(window.first_y, n, true); y + n < window.rows; y += 2 * n) {
            for (int x = first_multiple(window.first_x, n, true); x + n < window.columns;
                 x += 2 * n) {
                const float below = std::max(std::max(window.bounds[window.at(x - n, y)],
                                                      window.bounds[window.at(x + n, y)]),
                                             std::max(window.bounds[window.at(x, y - n)],
                                                      window.bounds[window.at(x, y + n)]));
                window.bounds[window.at(x, y)] =
                    std::max(cell_deviation(window, x - n, y - n, 2 * n), below);
            }
        }
    }
}

}  // namespace terrane::internal
