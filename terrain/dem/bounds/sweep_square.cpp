// SPDX-License-Identifier: MIT
#include "bounds/sweep_square.h"

namespace terrane::internal {

Square make_square(const BoundTier& first, std::span<BoundTier> levels, std::size_t level,
                   std::int64_t i, std::int64_t j) {
    BoundTier& cells = levels[level];
    Square square;
    const std::int64_t side = square.side = cells.step / first.step;
    const std::int64_t west = square.west = i * side, south = square.south = j * side;
    const auto height = [&](std::int64_t x, std::int64_t y) {
        return first.heights[first.at(x, y)];
    };
    const double south_west = height(west, south), south_east = height(west + side, south);
    const double north_west = height(west, south + side),
                 north_east = height(west + side, south + side);
    const double whole = static_cast<double>(side);
    square.is_cut_north_east = ((i + j) & 1) == 0;
    if (cells.contains(i, j)) {
        float* deviation = &cells.cell_bounds[cells.at(i, j)];
        const double along_south = (south_east - south_west) / whole;
        const double along_north = (north_east - north_west) / whole;
        const double along_west = (north_west - south_west) / whole;
        const double along_east = (north_east - south_east) / whole;
        if (square.is_cut_north_east) {
            square.lower = {{south_west, along_south, along_east}, deviation};
            square.upper = {{south_west, along_north, along_west}, deviation};
        } else {
            square.lower = {{south_west, along_south, along_west}, deviation};
            square.upper = {
                {north_east - whole * (along_north + along_east), along_north, along_east},
                deviation};
        }
    }
    if (level == 0) return square;
    BoundTier& middles = levels[level - 1];
    const double centre = height(west + side / 2, south + side / 2), half = 0.5 * whole;
    const auto add_side = [&](Target& target, std::int64_t x, std::int64_t y, double begin,
                              double end, double up, bool along_x) {
        if (!middles.contains(x, y)) return;
        target.deviation = &middles.bounds[middles.at(x, y)];
        const double along = (end - begin) / whole;
        // From the side to the centre; `up` is 1 for the sides in the south and the west.
        const double across = up * (centre - 0.5 * (begin + end)) / half;
        const double corner = up > 0.0 ? begin : begin - whole * across;
        target.plane = along_x ? Plane{corner, along, across} : Plane{corner, across, along};
    };
    add_side(square.south_side, 2 * i + 1, 2 * j, south_west, south_east, 1.0, true);
    add_side(square.north_side, 2 * i + 1, 2 * j + 2, north_west, north_east, -1.0, true);
    add_side(square.west_side, 2 * i, 2 * j + 1, south_west, north_west, 1.0, false);
    add_side(square.east_side, 2 * i + 2, 2 * j + 1, south_east, north_east, -1.0, false);
    return square;
}

Range corner_range(const std::array<double, 4>& heights, const Plane& plane, std::int64_t x,
                   std::int64_t y, Part part) {
    const double south_west = heights[0] - plane.at(x, y);
    const double south_east = heights[1] - plane.at(x + 1, y);
    const double north_west = heights[2] - plane.at(x, y + 1);
    const double north_east = heights[3] - plane.at(x + 1, y + 1);
    Range range;
    if (part != Part::north_east) range.add(south_west);
    if (part != Part::north_west) range.add(south_east);
    if (part != Part::south_east) range.add(north_west);
    if (part != Part::south_west) range.add(north_east);
    return range;
}

}  // namespace terrane::internal
