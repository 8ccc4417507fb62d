// SPDX-License-Identifier: MIT
//
// A-priori bounds of the deviation of a piecewise bilinear surface from the triangles of a lattice.
//
// Aligned: a lattice cell of side s lies in one raster cell of side c. The surface in it is a plane
// plus xy times the twist T / c^2, which leaves either diagonal's triangles by |T| / 4 (s / c)^2.
//
// Not aligned: a triangle of the lattice, legs a <= a raster cell, crosses at most one grid line along each
// axis. Across a vertical line the slope jumps by at most Jx, across a horizontal one by Jy; t is the
// largest |twist| / (cell_x cell_y). On a segment of length L that crosses a kink of J, ends taken
// from the surface, the chord is off by at most J L w (1 - w), w the point's place along it. A point
// of the triangle lies on a chord along x that ends on a leg (one kink: a tau (1 - tau) Jy) and on
// the hypotenuse (both kinks and the twist: a tau (1 - tau) (Jx + Jy + a t)), L = a tau:
//     a Jx tau w (2 - w - tau) + a Jy tau (1 - tau) + a^2 t w tau (1 - tau)
//  <= 8/27 a Jx + 1/4 a Jy + 1/4 a^2 t
// and the same with x and y exchanged: the lesser is 1/4 a (Jx + Jy) + 5/108 a min(Jx, Jy)
// + 1/4 a^2 t. With J and t as maxima over all descendants of a vertex these bounds are nested. That of the
// centre of a square of side a holds for all its descendants.
#include "surface/fine_surface.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// The last raster cell that a region with this end overlaps.
std::int64_t last_cell(const SamplePlace& end) {
    return end.fraction > 0.0 ? end.index : end.index - 1;
}
/// The first sample at or after a position.
std::int64_t sample_after(const SamplePlace& place) { return last_cell(place) + 1; }

/// Off the lattice, deviations are computed for vertices of the requested spacing and of half of it; the a-priori bound
/// of the kinks nearby covers all finer ones.
constexpr std::int64_t kFinerStep = 2;
constexpr double kRounding = 1e-9;

/// Whether an index, a multiple of step, is an odd one.
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
    // Other raster cells are covered by vertices of half this spacing.
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
    // This order of operations is monotone, so that rounding keeps the bounds nested.
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
            // At least the exact deviation at a single kink, computed in another order of operations.
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
    const auto patch = this->patch(grid, kBoundsMargin);
    if (!patch) return tl::unexpected(patch.error());
    std::fill(bounds_out.begin(), bounds_out.end(), 0.0f);
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++at) {
            if (((row | column) & 1) == 0) continue;  // of a coarser spacing
            const LatticePoint v{grid.corner.x + column * grid.step,
                                 grid.corner.y + row * grid.step};
            bounds_out[at] = aligned_bound(*patch, v, grid.step);
        }
    }
    return {};
}

Result<void> FineSurface::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const std::int64_t base = grid_.base_step();
    if (grid_.aligned && grid.step < base) return aligned_vertex_bounds(grid, bounds_out);
    const std::int64_t step =
        std::min(grid_.aligned ? base : std::max<std::int64_t>(grid.step / kFinerStep, 1), base);
    const int n = static_cast<int>(grid.step / step), apron = 3 * n;
    auto window = bounds_window({{grid.corner.x - 3 * grid.step, grid.corner.y - 3 * grid.step},
                                 step,
                                 (grid.columns - 1) * n + 2 * apron + 1,
                                 (grid.rows - 1) * n + 2 * apron + 1});
    if (!window) return tl::unexpected(window.error());
    compute_bounds(*window, n);
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            // The grid's corner is a multiple of twice its step.
            const bool is_coarser = ((row | column) & 1) == 0;
            bounds_out[at++] =
                is_coarser ? 0.0f : window->bounds[window->at(apron + column * n, apron + row * n)];
        }
    }
    return {};
}

Result<void> FineSurface::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    const std::int64_t step = std::min(grid.step, grid_.base_step());
    const int n = static_cast<int>(grid.step / step);
    auto made =
        surface_window({grid.corner, step, (grid.columns - 1) * n + 1, (grid.rows - 1) * n + 1});
    if (!made) return tl::unexpected(made.error());
    if (n == 1 && made->kinked) made->kinked->keep_diagonals(1);
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column) {
            bounds_out[at++] = cell_deviation(*made, column * n, row * n, n);
        }
    }
    return {};
}

Result<DiamondWindow> FineSurface::bounds_window(const SampleGrid& grid) const {
    const auto patch = this->patch(grid, kBoundsMargin);
    if (!patch) return tl::unexpected(patch.error());
    DiamondWindow window = make_window(*patch, grid);
    const std::int64_t half = grid.step / 2;
    if (half == 0) return window;
    window.middle_bounds.resize(static_cast<std::size_t>(grid.columns - 1) *
                                static_cast<std::size_t>(grid.rows - 1));
    const SampleGrid middles{
        {grid.corner.x + half, grid.corner.y + half}, grid.step, grid.columns - 1, grid.rows - 1};
    if (grid_.aligned) {
        aligned_bounds(*patch, middles, half, window.middle_bounds);
    } else {
        kinked_bounds(*patch, middles, half, window.middle_bounds);
    }
    return window;
}

}  // namespace terrane::internal
