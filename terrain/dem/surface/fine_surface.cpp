// SPDX-License-Identifier: MIT
#include "surface/fine_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

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
    // Clamped, so that indices far beyond the raster, where the edge is repeated, fit.
    constexpr std::int64_t kBeyond = 8;
    column.index = std::clamp<std::int64_t>(column.index, -kBeyond, grid_.columns + kBeyond);
    row.index = std::clamp<std::int64_t>(row.index, -kBeyond, grid_.rows + kBeyond);
    std::array<double, 4> z{};
    if (auto read = store_->read(column.index, row.index, 2, 2, z); !read) {
        return tl::unexpected(read.error());
    }
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
        const double* south = patch.samples.data() + (v.index - patch.row) * patch.columns;
        const double* north = south + patch.columns;
        for (const SamplePlace& u : columns) {
            const std::ptrdiff_t i = u.index - patch.column;
            heights_out[at++] =
                bilinear(south[i], south[i + 1], north[i], north[i + 1], u.fraction, v.fraction);
        }
    }
}

Result<DiamondWindow> FineSurface::surface_window(const SampleGrid& grid) const {
    const auto patch = this->patch(grid, kBoundsMargin);
    if (!patch) return tl::unexpected(patch.error());
    return make_window(*patch, grid);
}

DiamondWindow FineSurface::make_window(const RasterPatch& patch, const SampleGrid& grid) const {
    DiamondWindow window;
    window.first_x = grid.corner.x / grid.step;
    window.first_y = grid.corner.y / grid.step;
    window.columns = grid.columns;
    window.rows = grid.rows;
    window.heights.resize(grid.size());
    sample(patch, grid, window.heights);
    if (!grid_.aligned) window.kinked = std::make_shared<KinkedSurface>(grid_, grid, patch);
    return window;
}

}  // namespace terrane::internal
