// SPDX-License-Identifier: MIT
//
// How far a piecewise bilinear surface leaves the triangles of a lattice.
//
// Aligned: a lattice cell of side s lies in one raster cell of side c. The surface in it is a plane
// plus xy times the twist T / c^2, which leaves either diagonal's triangles by |T| / 4 (s / c)^2.
//
// Not aligned: a triangle of the lattice, legs a <= a raster cell, crosses at most one grid line each
// way. Across a vertical line the slope jumps by at most Jx, across a horizontal one by Jy; t is the
// largest |twist| / (cell_x cell_y). On a segment of length L that crosses a kink of J, ends taken
// from the surface, the chord is off by at most J L w (1 - w), w the point's place along it. A point
// of the triangle lies on a chord along x that ends on a leg (one kink: a tau (1 - tau) Jy) and on
// the hypotenuse (both kinks and the twist: a tau (1 - tau) (Jx + Jy + a t)), L = a tau:
//     a Jx tau w (2 - w - tau) + a Jy tau (1 - tau) + a^2 t w tau (1 - tau)
//  <= 8/27 a Jx + 1/4 a Jy + 1/4 a^2 t
// and the same with x and y exchanged: the lesser is 1/4 a (Jx + Jy) + 5/108 a min(Jx, Jy)
// + 1/4 a^2 t. A triangle over a hypotenuse of 2 a along x, height a, gets from chords along x
//     1/2 a Jx + 1/4 a Jy + 1/4 a^2 t.
// With J and t over all that lies below a vertex these bounds are nested.
#include "fine_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace terrane::internal {
namespace {

/// The last raster cell that a region ending at a place reaches into.
std::int64_t last_cell(const SamplePlace& end) {
    return end.fraction > 0.0 ? end.index : end.index - 1;
}
/// The first sample at or after a place.
std::int64_t sample_after(const SamplePlace& place) { return last_cell(place) + 1; }

/// Whether an index, a multiple of step, is an odd one.
bool is_odd_multiple(std::int64_t index, std::int64_t step) {
    return (index & (2 * step - 1)) != 0;
}

}  // namespace

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
    // Far beyond the raster the indices would not fit; there the edge is repeated anyway.
    constexpr std::int64_t kBeyond = 8;
    column.index = std::clamp<std::int64_t>(column.index, -kBeyond, grid_.columns + kBeyond);
    row.index = std::clamp<std::int64_t>(row.index, -kBeyond, grid_.rows + kBeyond);
    std::array<float, 4> z{};
    if (auto read = store_->read(column.index, row.index, 2, 2, z); !read) {
        return tl::unexpected(read.error());
    }
    return bilinear(static_cast<double>(z[0]), static_cast<double>(z[1]), static_cast<double>(z[2]),
                    static_cast<double>(z[3]), column.fraction, row.fraction);
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
    if (auto read = store_->read(patch.column, patch.row, patch.columns, patch.rows, patch.samples);
        !read) {
        return tl::unexpected(read.error());
    }
    return patch;
}

void FineSurface::sample(const RasterPatch& patch, const SampleGrid& grid,
                         std::span<double> heights_out) const {
    const std::vector<SamplePlace> columns = places(grid.corner.x, grid.step, grid.columns, true);
    const std::vector<SamplePlace> rows = places(grid.corner.y, grid.step, grid.rows, false);
    std::size_t at = 0;
    for (const SamplePlace& v : rows) {
        const float* south = patch.samples.data() + (v.index - patch.row) * patch.columns;
        const float* north = south + patch.columns;
        for (const SamplePlace& u : columns) {
            const std::ptrdiff_t i = u.index - patch.column;
            heights_out[at++] =
                bilinear(static_cast<double>(south[i]), static_cast<double>(south[i + 1]),
                         static_cast<double>(north[i]), static_cast<double>(north[i + 1]),
                         u.fraction, v.fraction);
        }
    }
}

float FineSurface::aligned_bound(const RasterPatch& patch, LatticePoint v,
                                 std::int64_t step) const {
    // From the south-western sample, so that a shift gives the raster cell.
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
    // What belongs to other raster cells is reached through vertices of half this size.
    return round_outward(0.25 * part * part * std::max(own, 0.25 * other));
}

/// The samples that the part of an axis within `reach` of each vertex touches.
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
    const bool centre =
        is_odd_multiple(grid.corner.x, vertex_step) && is_odd_multiple(grid.corner.y, vertex_step);
    const bool along_x = is_odd_multiple(grid.corner.x, vertex_step);
    const std::int64_t reach = (centre ? 3 : 2) * vertex_step;
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
    // In this order of operations rounding keeps the bounds nested, too.
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
            const double t = warp * largest.twist;
            if (centre) {
                bounds_out[at] = round_outward((0.5 * (x + y) + 5.0 / 54.0 * std::min(x, y)) + t);
            } else {
                const double parallel = along_x ? x : y, across = along_x ? y : x;
                bounds_out[at] = round_outward((0.5 * parallel + 0.25 * across) + 0.25 * t);
            }
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

void FineSurface::vertex_bounds(const RasterPatch& patch, const SampleGrid& grid,
                                std::span<float> bounds_out) const {
    std::fill(bounds_out.begin(), bounds_out.end(), 0.0f);
    // Every second column and row: centres, midpoints of edges along x, midpoints along y.
    struct Kind {
        int column, row;
    };
    for (const Kind kind : {Kind{1, 1}, Kind{1, 0}, Kind{0, 1}}) {
        const SampleGrid vertices{
            {grid.corner.x + kind.column * grid.step, grid.corner.y + kind.row * grid.step},
            2 * grid.step,
            (grid.columns + 1 - kind.column) / 2,
            (grid.rows + 1 - kind.row) / 2};
        if (vertices.size() == 0) continue;
        std::vector<float> bounds(vertices.size());
        if (grid_.aligned) {
            aligned_bounds(patch, vertices, grid.step, bounds);
        } else {
            kinked_bounds(patch, vertices, grid.step, bounds);
        }
        auto from = bounds.begin();
        for (int row = kind.row; row < grid.rows; row += 2) {
            for (int column = kind.column; column < grid.columns; column += 2) {
                bounds_out[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                           static_cast<std::size_t>(column)] = *from++;
            }
        }
    }
}

void FineSurface::cell_bounds(const RasterPatch& patch, const SampleGrid& grid,
                              std::span<float> bounds_out) const {
    std::vector<double> heights(grid.size());
    sample(patch, grid, heights);
    std::optional<KinkedSurface> kinked;
    if (!grid_.aligned) {
        kinked.emplace(grid_, grid, patch);
        kinked->keep_diagonals(1);
    }
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column, ++at) {
            const std::size_t corner =
                static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                static_cast<std::size_t>(column);
            const std::size_t above = corner + static_cast<std::size_t>(grid.columns);
            const double south_west = heights[corner], south_east = heights[corner + 1];
            const double north_west = heights[above], north_east = heights[above + 1];
            if (!kinked) {
                const double twist = south_west - south_east - north_west + north_east;
                bounds_out[at] = round_outward(0.25 * std::fabs(twist));
                continue;
            }
            const std::int64_t parity =
                (grid.corner.x / grid.step + column) + (grid.corner.y / grid.step + row);
            Range range;
            if ((parity & 1) == 0) {
                kinked->add_triangle(
                    {column + 1, row, -1, 1, 1, south_east, south_west, north_east}, range);
                kinked->add_triangle(
                    {column, row + 1, 1, -1, 1, north_west, north_east, south_west}, range);
            } else {
                kinked->add_triangle({column, row, 1, 1, 1, south_west, south_east, north_west},
                                     range);
                kinked->add_triangle(
                    {column + 1, row + 1, -1, -1, 1, north_east, north_west, south_east}, range);
            }
            bounds_out[at] = round_outward(range.deviation());
        }
    }
}

Result<DiamondWindow> FineSurface::base_window(std::int64_t first_x, std::int64_t first_y,
                                               int columns, int rows) const {
    const std::int64_t step = grid_.base_step();
    const SampleGrid grid{{first_x * step, first_y * step}, step, columns, rows};
    const auto patch = this->patch(grid, kBoundsMargin);
    if (!patch) return tl::unexpected(patch.error());
    DiamondWindow window;
    window.first_x = first_x;
    window.first_y = first_y;
    window.columns = columns;
    window.rows = rows;
    window.heights.resize(grid.size());
    sample(*patch, grid, window.heights);
    const std::size_t cells =
        static_cast<std::size_t>(columns - 1) * static_cast<std::size_t>(rows - 1);
    if (!grid_.aligned) {
        window.kinked = std::make_shared<KinkedSurface>(grid_, grid, *patch);
    }
    if (step > 1) {
        window.middle_bounds.resize(cells);
        const std::int64_t half = step / 2;
        const SampleGrid middles{
            {grid.corner.x + half, grid.corner.y + half}, step, columns - 1, rows - 1};
        if (grid_.aligned) {
            aligned_bounds(*patch, middles, half, window.middle_bounds);
        } else {
            kinked_bounds(*patch, middles, half, window.middle_bounds);
        }
    }
    return window;
}

}  // namespace terrane::internal
