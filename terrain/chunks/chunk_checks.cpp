// SPDX-License-Identifier: MIT
#include "chunks/chunk_checks.h"

#include "source/bounds/bound_triangles.h"
#include "source/bounds/rounding.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace terrane::internal {
Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights) {
    const auto stride = static_cast<int>(grid.step / samples.step);
    const auto first_column = static_cast<int>((grid.corner.x - samples.corner.x) / samples.step);
    const auto first_row = static_cast<int>((grid.corner.y - samples.corner.y) / samples.step);
    // whether the index sum of the first square of side 2 s is odd
    const std::int64_t side = 2 * grid.step;
    const auto parity = static_cast<int>((grid.corner.x / side + grid.corner.y / side) & 1);
    const auto has = [&](int column, int row) {
        return column >= 0 && row >= 0 && column < samples.columns && row < samples.rows;
    };
    const auto at = [&](int column, int row) {
        return heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.columns) +
                       static_cast<std::size_t>(column)];
    };
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < grid.columns;
             column += row % 2 == 0 ? 2 : 1) {
            // offset from the vertex to one of its ends; the other end is opposite
            const bool is_centre = (column & row & 1) != 0;
            const bool rises = ((column / 2 + row / 2 + parity) & 1) == 0;
            const int to_x = column % 2 * stride;
            const int to_y = row % 2 * (is_centre && !rises ? -stride : stride);
            const int x = first_column + column * stride, y = first_row + row * stride;
            if (!has(x - to_x, y - to_y) || !has(x + to_x, y + to_y)) continue;
            const double height = at(x, y);
            const double rise =
                std::abs(height - 0.5 * (at(x - to_x, y - to_y) + at(x + to_x, y + to_y)));
            const auto bound = static_cast<double>(
                bounds[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)]);
            if (!(rise > bound + kHeightAccuracy + 0x1p-50 * std::abs(height))) continue;
            char text[192];
            std::snprintf(
                text, sizeof text,
                "the source's bound at (%.6g, %.6g) m, spacing %.6g m, is %.4g m, but its "
                "samples are %.4g m apart there",
                lattice.x(grid.corner.x + column * grid.step),
                lattice.y(grid.corner.y + row * grid.step),
                lattice.spacing * static_cast<double>(grid.step), bound, rise);
            return fail(ErrorCode::bad_data, text);
        }
    }
    return {};
}

#if TERRANE_ASSERTS
void assert_source_holds(const HeightSource& source, const SampleGrid& grid,
                         std::span<const double> heights, std::span<const float> cell_bounds) {
    constexpr int kSpots = 32;
    const Lattice& lattice = source.lattice();
    const auto refuse = [&](const char* what, double x, double y, double claimed, double measured) {
        char text[224];
        std::snprintf(text, sizeof text,
                      "the source's %s at (%.6g, %.6g) m, spacing %.6g m: claimed %.6g m, measured "
                      "%.6g m; check_source() tells more",
                      what, x, y, lattice.spacing * static_cast<double>(grid.step), claimed,
                      measured);
        assert_failed("HeightSource keeps its promises", text, __FILE__, __LINE__);
    };
    const double west = lattice.x(grid.corner.x), south = lattice.y(grid.corner.y);
    const double east = lattice.x(grid.corner.x + grid.step * (grid.columns - 1));
    const double north = lattice.y(grid.corner.y + grid.step * (grid.rows - 1));
    const HeightInterval held = source.interval({west, south, east, north});
    const auto [lowest, highest] = std::ranges::minmax_element(heights);
    const double slack = kHeightAccuracy + 0x1p-50 * (std::abs(*lowest) + std::abs(*highest));
    if (!(*lowest >= held.low - slack)) refuse("interval", west, south, held.low, *lowest);
    if (!(*highest <= held.high + slack)) refuse("interval", west, south, held.high, *highest);

    // points by integer hashing of the chunk's address: always the same ones
    const WorldRect& extent = source.extent();
    std::uint64_t state = static_cast<std::uint64_t>(grid.corner.x) * 0x9e3779b97f4a7c15u ^
                          static_cast<std::uint64_t>(grid.corner.y) ^
                          static_cast<std::uint64_t>(grid.step) << 32;
    const auto draw = [&](int count) {
        state = state * 0x5851f42d4c957f2du + 0x14057b7ef767814fu;
        return static_cast<int>((state >> 33) % static_cast<std::uint64_t>(count));
    };
    for (int spot = 0; spot < kSpots; ++spot) {
        const int column = draw(grid.columns - 1), row = draw(grid.rows - 1);
        const LatticePoint corner{grid.corner.x + column * grid.step,
                                  grid.corner.y + row * grid.step};
        const LatticeTriangle triangle =
            cut_square(corner, grid.step)[static_cast<std::size_t>(draw(2))];
        double a = draw(1024) / 1024.0, b = draw(1024) / 1024.0;
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        const double weights[] = {1.0 - a - b, a, b};
        double x = 0.0, y = 0.0, plane = 0.0, low = *highest, high = *lowest;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto at_column = (triangle[i].x - grid.corner.x) / grid.step;
            const auto at_row = (triangle[i].y - grid.corner.y) / grid.step;
            const double height =
                heights[static_cast<std::size_t>(at_row * grid.columns + at_column)];
            x += weights[i] * lattice.x(triangle[i].x);
            y += weights[i] * lattice.y(triangle[i].y);
            plane += weights[i] * height;
            low = std::min(low, height);
            high = std::max(high, height);
        }
        if (!extent.contains(x, y)) continue;
        const double off = std::abs(source.height(x, y) - plane);
        const auto bound = static_cast<double>(
            cell_bounds[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns - 1) +
                        static_cast<std::size_t>(column)]);
        // allowance for the rounding of the position, times the ground's slope
        const double slope =
            (high - low + off) / (lattice.spacing * static_cast<double>(grid.step));
        const double rounding =
            kHeightAccuracy + 0x1p-50 * (std::abs(plane) + slope * (std::abs(x) + std::abs(y)));
        // NaN: the source could not be read, which violates nothing
        if (off > bound + rounding) refuse("cell bound", x, y, bound, off);
    }
}
#endif

}  // namespace terrane::internal
