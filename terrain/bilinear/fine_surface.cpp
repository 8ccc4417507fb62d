// SPDX-License-Identifier: MIT
//
// Sources: P. Lindstrom, V. Pascucci, Terrain Simplification Simplified: A General Framework for
//          View-Dependent Out-of-Core Visualization, IEEE TVCG 8(3), 2002: nested bounds over the
//          4-8 mesh.
// Deviations: the bound of a vertex is the deviation of the surface itself from the vertex's two triangles, found over
//          all lattice points in them, instead of the height differences of single splits.
#include "bilinear/fine_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

/// Longest leg of a triangle, in cells.
constexpr int kMaxLeg = 128;

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

/// The same for legs of one cell, the most frequent case: the surface can deviate only at the right-angled corner and
/// on the hypotenuse, there by a quarter of the cell's twist.
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

/// Largest deviation over the two triangles that share the edge from (x - n, y) to (x + n, y), or from (x, y - n) to
/// (x, y + n), evaluated as four right triangles around its midpoint.
float edge_deviation(const DiamondWindow& window, int x, int y, int n, bool along_x) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    const double west = height(x - n, y), east = height(x + n, y);
    const double south = height(x, y - n), north = height(x, y + n);
    const double middle = along_x ? 0.5 * (west + east) : 0.5 * (south + north);
    const std::array<RightTriangle, 4> quarters{{{x, y, 1, 1, n, middle, east, north},
                                                 {x, y, -1, 1, n, middle, west, north},
                                                 {x, y, -1, -1, n, middle, west, south},
                                                 {x, y, 1, -1, n, middle, east, south}}};
    // Over equal rows the southern quarters mirror the northern ones; over equal columns the western ones, the eastern.
    const bool is_northern_enough = window.has_equal_rows(y - n, y + n);
    const bool is_eastern_enough = window.has_equal_columns(x - n, x + n);
    Range range;
    for (const RightTriangle& quarter : quarters) {
        if ((is_northern_enough && quarter.sign_y < 0) || (is_eastern_enough && quarter.sign_x < 0))
            continue;
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

// A vertex's own deviation is that of its neighbour of the same kind, 2 n away, if the rows (or columns) around both
// are equal: the same heights enter the same operations. This includes cells, although neighbours are cut along
// different diagonals. Over equal rows both planes of a cell are level along y; one starts from the eastern corner, the
// other one from the western corner, whichever diagonal divides them. Where the rows around the descendants of both are
// equal too, up to 3 n away, so are their bounds.
void compute_bounds(DiamondWindow& window, int last_n) {
    window.bounds.resize(window.heights.size(), 0.0f);
    std::vector<float> deviations(static_cast<std::size_t>(window.columns));
    const auto for_each_vertex = [&](int n, bool odd_x, bool odd_y, auto&& deviation_at,
                                     auto&& below_at) {
        const int first_x = first_multiple(window.first_x, n, odd_x);
        const int first_y = first_multiple(window.first_y, n, odd_y);
        for (int y = first_y; y + n < window.rows; y += 2 * n) {
            const bool repeats_row = y > first_y && window.has_equal_rows(y - 3 * n, y + n);
            const bool repeats_bounds = y >= 5 * n && y + 3 * n < window.rows &&
                                        window.has_equal_rows(y - 5 * n, y + 3 * n);
            for (int x = first_x; x + n < window.columns; x += 2 * n) {
                float& bound = window.bounds[window.at(x, y)];
                if (repeats_bounds) {
                    bound = window.bounds[window.at(x, y - 2 * n)];
                    continue;
                }
                float& deviation = deviations[static_cast<std::size_t>(x)];
                if (!repeats_row) {
                    deviation = x > first_x && window.has_equal_columns(x - 3 * n, x + n)
                                    ? deviations[static_cast<std::size_t>(x - 2 * n)]
                                    : deviation_at(x, y);
                }
                bound = std::max(deviation, below_at(x, y));
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
                [&](int x, int y) { return edge_deviation(window, x, y, n, along_x); },
                [&](int x, int y) { return largest_around(window, x, y, n); });
        }
        for_each_vertex(
            n, true, true,
            [&](int x, int y) { return cell_deviation(window, x - n, y - n, 2 * n); },
            [&](int x, int y) {
                return std::max(std::max(window.bounds[window.at(x - n, y)],
                                         window.bounds[window.at(x + n, y)]),
                                std::max(window.bounds[window.at(x, y - n)],
                                         window.bounds[window.at(x, y + n)]));
            });
    }
}

std::vector<SamplePlace> FineSurface::places(std::int64_t first, std::int64_t step, int count,
                                             bool along_x) const {
    std::vector<SamplePlace> all;
    all.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const std::int64_t index = first + i * step;
        all.push_back(along_x ? grid_.column_at_index(index) : grid_.row_at_index(index));
    }
    return all;
}

Result<double> FineSurface::height(SamplePlace column, SamplePlace row) const {
    // Indices far beyond the raster, where its edge is repeated, are clamped to fit in an int.
    constexpr std::int64_t kBeyond = 8;
    column.index = std::clamp<std::int64_t>(column.index, -kBeyond, grid_.columns + kBeyond);
    row.index = std::clamp<std::int64_t>(row.index, -kBeyond, grid_.rows + kBeyond);
    std::array<double, 4> z{};
    TERRANE_TRY(samples_->read(column.index, row.index, 2, 2, z));
    return bilinear(z[0], z[1], z[2], z[3], column.fraction, row.fraction);
}

Result<RasterPatch> FineSurface::patch(const SampleGrid& grid, int margin) const {
    const auto west = grid_.column_at_index(grid.corner.x);
    const auto south = grid_.row_at_index(grid.corner.y);
    const auto east = grid_.column_at_index(grid.corner.x + (grid.columns - 1) * grid.step);
    const auto north = grid_.row_at_index(grid.corner.y + (grid.rows - 1) * grid.step);
    RasterPatch patch;
    patch.column = west.index - margin;
    patch.row = south.index - margin;
    patch.columns = static_cast<int>(east.index + 2 + margin - patch.column);
    patch.rows = static_cast<int>(north.index + 2 + margin - patch.row);
    patch.samples.resize(static_cast<std::size_t>(patch.columns) *
                         static_cast<std::size_t>(patch.rows));
    TERRANE_TRY(samples_->read(patch.column, patch.row, patch.columns, patch.rows, patch.samples));
    return patch;
}

namespace {

/// The places from the last one below the raster's edge to the first one above the opposite edge, as the first one and
/// the end. All beyond these have the same heights: the samples on both sides of them are equal.
std::pair<std::size_t, std::size_t> distinct_places(const std::vector<SamplePlace>& places,
                                                    int samples) {
    const auto first_at_or_after = [&](std::int64_t index) {
        return static_cast<std::size_t>(
            std::ranges::lower_bound(places, index, {}, &SamplePlace::index) - places.begin());
    };
    const std::size_t begin = first_at_or_after(0), end = first_at_or_after(samples - 1);
    return {begin - std::min<std::size_t>(begin, 1), std::min(end + 1, places.size())};
}

}  // namespace

void FineSurface::sample(const RasterPatch& patch, const SampleGrid& grid,
                         std::span<double> heights_out) const {
    const std::vector<SamplePlace> columns = places(grid.corner.x, grid.step, grid.columns, true);
    const std::vector<SamplePlace> rows = places(grid.corner.y, grid.step, grid.rows, false);
    const auto [west, east] = distinct_places(columns, grid_.columns);
    const auto [south, north] = distinct_places(rows, grid_.rows);
    const std::size_t width = columns.size();
    const auto line = [&](std::size_t y) { return heights_out.data() + y * width; };
    for (std::size_t y = south; y < north; ++y) {
        const SamplePlace& v = rows[y];
        const double* below = patch.samples.data() + (v.index - patch.row) * patch.columns;
        const double* above = below + patch.columns;
        double* out = line(y);
        for (std::size_t x = west; x < east; ++x) {
            const SamplePlace& u = columns[x];
            const std::ptrdiff_t i = u.index - patch.column;
            out[x] =
                bilinear(below[i], below[i + 1], above[i], above[i + 1], u.fraction, v.fraction);
        }
        std::fill(out, out + west, out[west]);
        std::fill(out + east, out + width, out[east - 1]);
    }
    for (std::size_t y = 0; y < south; ++y) std::copy_n(line(south), width, line(y));
    for (std::size_t y = north; y < rows.size(); ++y) std::copy_n(line(north - 1), width, line(y));
}

Result<DiamondWindow> FineSurface::surface_window(const SampleGrid& grid) const {
    TERRANE_TRY(const auto patch, this->patch(grid, kBoundsMargin));
    return make_window(patch, grid);
}

DiamondWindow FineSurface::make_window(const RasterPatch& patch, const SampleGrid& grid) const {
    DiamondWindow window;
    window.first_x = grid.corner.x / grid.step;
    window.first_y = grid.corner.y / grid.step;
    window.columns = grid.columns;
    window.rows = grid.rows;
    window.heights.resize(grid.size());
    sample(patch, grid, window.heights);
    if (grid_.aligned) {
        window.find_runs();
    } else {
        window.kinked = std::make_shared<KinkedSurface>(grid_, grid, patch);
    }
    return window;
}

// A-priori bounds of the deviation of a piecewise bilinear surface from the triangles of a lattice.
//
// Aligned: a lattice cell of side s lies in one raster cell of side c with the twist T. The surface over it is a plane
// plus x y T / c^2, which deviates from the triangles of either diagonal by |T| / 4 (s / c)^2.
//
// Not aligned: a triangle of the lattice whose legs a are at most a raster cell's side crosses at most one grid line
// along each axis. The slope jumps by at most Jx across a line along y, and by Jy across a line along x; t is the
// largest |twist| / (cell_x cell_y). A chord of length L with its ends on the surface that crosses a jump J deviates
// from the surface by at most J L w (1 - w) at the relative position w. A point of the triangle lies on a chord along x
// of length L = a tau. One end is on a leg, off by a tau (1 - tau) Jy; the other is on the hypotenuse, off by
// a tau (1 - tau) (Jx + Jy + a t). In total the point is off by
//     a Jx tau w (2 - w - tau) + a Jy tau (1 - tau) + a^2 t w tau (1 - tau)
//  <= 8/27 a Jx + 1/4 a Jy + 1/4 a^2 t
// The same holds with x and y exchanged; the smaller bound is 1/4 a (Jx + Jy) + 5/108 a min(Jx, Jy) + 1/4 a^2 t. These
// bounds are nested if J and t are maxima over all descendants of a vertex. The bound of the centre of a square of side
// a holds for all its descendants.

namespace {

/// The last raster cell that a region ending here overlaps.
std::int64_t last_cell(const SamplePlace& end) {
    return end.fraction > 0.0 ? end.index : end.index - 1;
}
/// The first sample at or after a position.
std::int64_t sample_after(const SamplePlace& place) { return last_cell(place) + 1; }

/// If not aligned, deviations are computed for vertices of the requested spacing and of half of it; an a-priori bound
/// covers all finer vertices.
constexpr std::int64_t kFinerStep = 2;
/// The rows of a grid whose bounds are computed in one window, even: windows then fit in the processor's cache, and
/// their memory need not be fetched from the system.
constexpr int kBandRows = 32;
constexpr double kRounding = 1e-9;

/// Whether an index, a multiple of step, is an odd multiple.
bool is_odd_multiple(std::int64_t index, std::int64_t step) {
    return (index & (2 * step - 1)) != 0;
}

}  // namespace

float FineSurface::aligned_bound(const RasterPatch& patch, LatticePoint v,
                                 std::int64_t step) const {
    // Relative to the south-western sample, so that a shift gives the raster cell.
    const std::int64_t x = v.x - grid_.first.x, y = v.y - grid_.first.y;
    const bool centre = is_odd_multiple(x, step) && is_odd_multiple(y, step);
    const std::int64_t reach = (centre ? 3 : 2) * step;
    const int shift = grid_.cell_log2;
    // A midpoint may lie on the edge between two raster cells.
    const std::int64_t own_west = (x - 1) >> shift, own_east = x >> shift;
    const std::int64_t own_south = (y - 1) >> shift, own_north = y >> shift;
    double own = 0.0, other = 0.0;
    for (std::int64_t r = (y - reach) >> shift; r <= (y + reach - 1) >> shift; ++r) {
        for (std::int64_t c = (x - reach) >> shift; c <= (x + reach - 1) >> shift; ++c) {
            const double twist = std::fabs(patch.twist(c, r));
            const bool is_own = c >= own_west && c <= own_east && r >= own_south && r <= own_north;
            double& largest = is_own ? own : other;
            largest = std::max(largest, twist);
        }
    }
    const double part =
        static_cast<double>(centre ? 2 * step : step) / static_cast<double>(grid_.base_step());
    // The other raster cells contain only descendants, with at most half this spacing: hence a quarter.
    return round_outward(0.25 * part * part * std::max(own, 0.25 * other));
}

/// The samples within `reach` of each vertex, along an axis.
struct FineSurface::Reach {
    std::int64_t first_cell, last_cell, end_sample;
};

std::vector<FineSurface::Reach> FineSurface::reaches(std::int64_t first, std::int64_t step,
                                                     int count, std::int64_t reach,
                                                     bool along_x) const {
    const std::vector<SamplePlace> begins = places(first - reach, step, count, along_x);
    const std::vector<SamplePlace> ends = places(first + reach, step, count, along_x);
    std::vector<Reach> all;
    all.reserve(begins.size());
    for (std::size_t i = 0; i < begins.size(); ++i) {
        all.push_back({begins[i].index, last_cell(ends[i]), sample_after(ends[i])});
    }
    return all;
}

void FineSurface::kinked_bounds(const RasterPatch& patch, const SampleGrid& grid,
                                std::int64_t vertex_step, std::span<float> bounds_out) const {
    const std::int64_t reach = 3 * vertex_step;
    const std::vector<Reach> columns = reaches(grid.corner.x, grid.step, grid.columns, reach, true);
    const std::vector<Reach> rows = reaches(grid.corner.y, grid.step, grid.rows, reach, false);

    // Largest bends and twist along each row of samples, then over the rows of each vertex.
    struct Largest {
        double bend_x = 0.0, bend_y = 0.0, twist = 0.0;
    };
    const std::int64_t first_row = rows.front().first_cell;
    const std::size_t width = columns.size();
    std::vector<Largest> along(static_cast<std::size_t>(rows.back().end_sample - first_row + 1) *
                               width);
    for (std::int64_t r = first_row; r <= rows.back().end_sample; ++r) {
        Largest* line = along.data() + static_cast<std::size_t>(r - first_row) * width;
        for (std::size_t i = 0; i < width; ++i) {
            for (std::int64_t c = columns[i].first_cell; c <= columns[i].last_cell; ++c) {
                if (c > columns[i].first_cell) {
                    line[i].bend_x = std::max(line[i].bend_x, std::fabs(patch.bend_x(c, r)));
                }
                line[i].bend_y = std::max(line[i].bend_y, std::fabs(patch.bend_y(c, r)));
                line[i].twist = std::max(line[i].twist, std::fabs(patch.twist(c, r)));
            }
            line[i].bend_y =
                std::max(line[i].bend_y, std::fabs(patch.bend_y(columns[i].end_sample, r)));
        }
    }
    // Every operation in this order is monotone, so that rounding keeps the bounds nested.
    const double s = grid_.lattice.spacing * static_cast<double>(vertex_step);
    const double jump_x = 1.0 / grid_.cell_x, jump_y = 1.0 / grid_.cell_y;
    const double warp = s * s / (grid_.cell_x * grid_.cell_y);
    std::size_t at = 0;
    for (const Reach& row : rows) {
        for (std::size_t i = 0; i < width; ++i, ++at) {
            Largest largest;
            for (std::int64_t r = row.first_cell; r <= row.end_sample; ++r) {
                const Largest& line = along[static_cast<std::size_t>(r - first_row) * width + i];
                largest.bend_x = std::max(largest.bend_x, line.bend_x);
                if (r > row.last_cell) continue;
                largest.twist = std::max(largest.twist, line.twist);
                if (r > row.first_cell) largest.bend_y = std::max(largest.bend_y, line.bend_y);
            }
            const double x = s * (largest.bend_x * jump_x), y = s * (largest.bend_y * jump_y);
            // The margin keeps the bound at or above the deviation at a single kink, which other operations compute.
            const double t = warp * largest.twist + kRounding;
            bounds_out[at] = round_outward((0.5 * (x + y) + 5.0 / 54.0 * std::min(x, y)) + t);
        }
    }
}

void FineSurface::aligned_bounds(const RasterPatch& patch, const SampleGrid& grid,
                                 std::int64_t vertex_step, std::span<float> bounds_out) const {
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const LatticePoint v{grid.corner.x + column * grid.step,
                                 grid.corner.y + row * grid.step};
            bounds_out[at++] = aligned_bound(patch, v, vertex_step);
        }
    }
}

Result<void> FineSurface::aligned_vertex_bounds(const SampleGrid& grid,
                                                std::span<float> bounds_out) const {
    TERRANE_TRY(const auto patch, this->patch(grid, kBoundsMargin));
    std::fill(bounds_out.begin(), bounds_out.end(), 0.0f);
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++at) {
            if (((row | column) & 1) == 0) continue;  // a vertex of a coarser spacing
            const LatticePoint v{grid.corner.x + column * grid.step,
                                 grid.corner.y + row * grid.step};
            bounds_out[at] = aligned_bound(patch, v, grid.step);
        }
    }
    return {};
}

Result<void> FineSurface::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    if (grid_.aligned && grid.step < grid_.base_step()) {
        return aligned_vertex_bounds(grid, bounds_out);
    }
    return window_bounds(grid, bounds_out, {});
}

std::int64_t FineSurface::vertex_window_step(const SampleGrid& grid) const {
    const std::int64_t base = grid_.base_step();
    return grid_.aligned ? base : std::clamp<std::int64_t>(grid.step / kFinerStep, 1, base);
}

std::int64_t FineSurface::cell_window_step(const SampleGrid& grid) const {
    return std::min(grid.step, grid_.base_step());
}

Result<void> FineSurface::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                      std::span<float> cell_bounds_out) const {
    if (grid.step >= grid_.base_step() && vertex_window_step(grid) == cell_window_step(grid)) {
        return window_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }
    TERRANE_TRY(vertex_bounds(grid, vertex_bounds_out));
    return cell_bounds(grid, cell_bounds_out);
}

Result<void> FineSurface::window_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                        std::span<float> cell_bounds_out) const {
    const std::int64_t step = vertex_window_step(grid);
    const int n = static_cast<int>(grid.step / step), apron = 3 * n;
    std::size_t vertex = 0, cell = 0;
    for (int first = 0; first < grid.rows; first += kBandRows) {
        const int rows = std::min(kBandRows, grid.rows - first);
        TERRANE_TRY(
            auto window,
            bounds_window({{grid.corner.x - 3 * grid.step, grid.corner.y + (first - 3) * grid.step},
                           step,
                           (grid.columns - 1) * n + 2 * apron + 1,
                           (rows - 1) * n + 2 * apron + 1}));
        compute_bounds(window, n);
        for (int row = 0; row < rows; ++row) {
            const int y = apron + row * n;
            for (int column = 0; column < grid.columns; ++column) {
                // The corners of the grid and of its bands are multiples of twice the step.
                const bool is_coarser = ((row | column) & 1) == 0;
                vertex_bounds_out[vertex++] =
                    is_coarser ? 0.0f : window.bounds[window.at(apron + column * n, y)];
            }
            if (cell_bounds_out.empty() || first + row + 1 == grid.rows) continue;
            for (int column = 0; column + 1 < grid.columns; ++column) {
                cell_bounds_out[cell++] = cell_deviation(window, apron + column * n, y, n);
            }
        }
    }
    return {};
}

Result<void> FineSurface::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const std::int64_t step = cell_window_step(grid);
    const int n = static_cast<int>(grid.step / step);
    std::size_t at = 0;
    for (int first = 0; first + 1 < grid.rows; first += kBandRows) {
        const int rows = std::min(kBandRows, grid.rows - 1 - first);
        TERRANE_TRY(auto window, surface_window({{grid.corner.x, grid.corner.y + first * grid.step},
                                                 step,
                                                 (grid.columns - 1) * n + 1,
                                                 rows * n + 1}));
        if (n == 1 && window.kinked) window.kinked->keep_diagonals(1);
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column) {
                bounds_out[at++] = cell_deviation(window, column * n, row * n, n);
            }
        }
    }
    return {};
}

Result<DiamondWindow> FineSurface::bounds_window(const SampleGrid& grid) const {
    TERRANE_TRY(const auto patch, this->patch(grid, kBoundsMargin));
    DiamondWindow window = make_window(patch, grid);
    const std::int64_t half = grid.step / 2;
    if (half == 0) return window;
    window.middle_bounds.resize(static_cast<std::size_t>(grid.columns - 1) *
                                static_cast<std::size_t>(grid.rows - 1));
    const SampleGrid middles{
        {grid.corner.x + half, grid.corner.y + half}, grid.step, grid.columns - 1, grid.rows - 1};
    if (grid_.aligned) {
        aligned_bounds(patch, middles, half, window.middle_bounds);
    } else {
        kinked_bounds(patch, middles, half, window.middle_bounds);
    }
    return window;
}

// Points of even column and row are not vertices: the corner is a multiple of twice the step. The diamonds of a centre
// and of all its descendants lie within three steps of it; the diamonds of a midpoint, within two.
void add_vertex_error(const SampleGrid& grid, const SurfaceError& error_over,
                      std::span<float> bounds) {
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++at) {
            const int odd = (row & 1) + (column & 1);
            if (odd == 0) {
                bounds[at] = 0.0f;
                continue;
            }
            const std::int64_t x = grid.corner.x + column * grid.step;
            const std::int64_t y = grid.corner.y + row * grid.step;
            const std::int64_t reach = (odd + 1) * grid.step;
            bounds[at] = round_outward(static_cast<double>(bounds[at]) +
                                       error_over({x - reach, y - reach}, {x + reach, y + reach}));
        }
    }
}

void add_cell_error(const SampleGrid& grid, const SurfaceError& error_over,
                    std::span<float> bounds) {
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column, ++at) {
            const double error = error_over(
                {grid.corner.x + column * grid.step, grid.corner.y + row * grid.step},
                {grid.corner.x + (column + 1) * grid.step, grid.corner.y + (row + 1) * grid.step});
            bounds[at] = round_outward(static_cast<double>(bounds[at]) + error);
        }
    }
}

}  // namespace terrane::internal
