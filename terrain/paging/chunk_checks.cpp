// SPDX-License-Identifier: MIT
#include "chunk_checks.h"

#include "bound_triangles.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace terrane::internal {
namespace {

constexpr double kHeightAccuracy = 1e-9;  // metres: HeightSource::height()

class Samples {
public:
    Samples(const SampleGrid& grid, std::span<const double> heights)
        : grid_(grid), heights_(heights) {}

    bool has(const LatticePoint& point) const {
        const std::int64_t column = (point.x - grid_.corner.x) / grid_.step;
        const std::int64_t row = (point.y - grid_.corner.y) / grid_.step;
        return point.x >= grid_.corner.x && point.y >= grid_.corner.y && column < grid_.columns &&
               row < grid_.rows;
    }
    double at(const LatticePoint& point) const {
        const std::int64_t column = (point.x - grid_.corner.x) / grid_.step;
        const std::int64_t row = (point.y - grid_.corner.y) / grid_.step;
        return heights_[static_cast<std::size_t>(row * grid_.columns + column)];
    }

private:
    SampleGrid grid_;
    std::span<const double> heights_;
};

}  // namespace

Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights) {
    const Samples known(samples, heights);
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < grid.columns;
             column += row % 2 == 0 ? 2 : 1) {
            const LatticePoint vertex{grid.corner.x + column * grid.step,
                                      grid.corner.y + row * grid.step};
            const LatticeTriangle half = diamond(vertex, grid.step)[0];
            if (!known.has(half[0]) || !known.has(half[1])) continue;
            const double height = known.at(vertex);
            const double middle = 0.5 * (known.at(half[0]) + known.at(half[1]));
            const double rise = std::abs(height - middle);
            const auto bound = static_cast<double>(
                bounds[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)]);
            if (!(rise > bound + kHeightAccuracy + 0x1p-50 * std::abs(height))) continue;
            char text[192];
            std::snprintf(
                text, sizeof text,
                "the source's bound at (%.6g, %.6g) m, spacing %.6g m, is %.4g m, but its "
                "samples are %.4g m apart there",
                lattice.x(vertex.x), lattice.y(vertex.y),
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

    // places by the integers of the chunk, so that a chunk is always checked at the same ones
    const Samples known(grid, heights);
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
        double x = 0.0, y = 0.0, plane = 0.0, low = known.at(triangle[0]), high = low;
        for (std::size_t i = 0; i < 3; ++i) {
            const double height = known.at(triangle[i]);
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
        // the place is rounded, on ground of this slope
        const double slope =
            (high - low + off) / (lattice.spacing * static_cast<double>(grid.step));
        const double rounding =
            kHeightAccuracy + 0x1p-50 * (std::abs(plane) + slope * (std::abs(x) + std::abs(y)));
        // NaN: the source could not be read, which is no broken promise
        if (off > bound + rounding) refuse("cell bound", x, y, bound, off);
    }
}
#endif

}  // namespace terrane::internal
