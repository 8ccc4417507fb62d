// SPDX-License-Identifier: MIT
#include "bilinear/fine_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace terrane::internal {

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
    const bool is_at_samples = grid_.aligned && grid.step % grid_.base_step() == 0 &&
                               columns.front().fraction == 0.0 && rows.front().fraction == 0.0;
    for (std::size_t y = south; y < north; ++y) {
        const SamplePlace& v = rows[y];
        const double* below = patch.samples.data() + (v.index - patch.row) * patch.columns;
        const double* above = below + patch.columns;
        double* out = line(y);
        for (std::size_t x = west; x < east; ++x) {
            const SamplePlace& u = columns[x];
            const std::ptrdiff_t i = u.index - patch.column;
            out[x] = is_at_samples ? below[i]
                                   : bilinear(below[i], below[i + 1], above[i], above[i + 1],
                                              u.fraction, v.fraction);
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
        DeviationRows deviations(window);
        for (int row = 0; row < rows; ++row) {
            const int y = apron + row * n;
            for (int column = 0; column < grid.columns; ++column) {
                // The corners of the grid and of its bands are multiples of twice the step.
                const bool is_coarser = ((row | column) & 1) == 0;
                vertex_bounds_out[vertex++] =
                    is_coarser ? 0.0f : window.bounds[window.at(apron + column * n, y)];
            }
            if (cell_bounds_out.empty() || first + row + 1 == grid.rows) continue;
            const std::size_t cells = static_cast<std::size_t>(grid.columns - 1);
            deviations.squares(apron, y, n, cell_bounds_out.subspan(cell, cells));
            cell += cells;
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
        DeviationRows deviations(window);
        const std::size_t cells = static_cast<std::size_t>(grid.columns - 1);
        for (int row = 0; row < rows; ++row, at += cells) {
            deviations.squares(0, row * n, n, bounds_out.subspan(at, cells));
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
