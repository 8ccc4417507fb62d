// SPDX-License-Identifier: MIT
//
// Beyond the raster the surface repeats the raster's edge: it is constant along x beyond its western
// and eastern edges, along y beyond the others. A plane is linear. So on a row of tiles beyond the
// western or eastern edge, surface minus plane is monotone in x over each triangle, and its
// extremes lie at the ends of the row and where the row meets the diagonals of the square;
// beyond a corner of the raster, at the vertices of the part of the triangle that lies there. Rounded
// sums and products are monotone, too: along a row or a column nothing is lost to rounding.
//
// A square of n x n tiles beyond the raster thus costs O(n) tiles, or O(1), instead of n^2, and a
// sweep over the squares around a long narrow raster is linear in its length.
#pragma once

#include "bounds/sweep_square.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace terrane::internal {

/// A rectangle of tiles; the end is excluded.
struct Tiles {
    std::int64_t west = 0, south = 0, east = 0, north = 0;

    bool empty() const { return west >= east || south >= north; }
    bool contains(const Tiles& other) const {
        return other.west >= west && other.south >= south && other.east <= east &&
               other.north <= north;
    }
};

namespace beyond {

/// The positions in [begin, end) of the interval's ends and of a line's intersections with a square's diagonals.
template <typename Visit>
void for_each_extreme(std::int64_t begin, std::int64_t end, std::int64_t line, std::int64_t side,
                      Visit&& visit) {
    std::array<std::int64_t, 4> places{begin, end - 1, line, side - 1 - line};
    std::ranges::sort(places);
    std::int64_t before = begin - 1;
    for (const std::int64_t place : places) {
        if (place <= before || place >= end) continue;
        visit(place);
        before = place;
    }
}

}  // namespace beyond

/// Visits tiles of a square beyond `core`, including all where surface minus plane is extreme over the part beyond
/// `core` of any triangle of the square.
///
/// @param core   a rectangle of tiles outside of which the surface repeats the raster's edge
/// @param visit  called with the tile's position x, y in the square; some tiles twice
template <typename Visit>
void for_each_extreme_tile(const Square& square, const Tiles& core, Visit&& visit) {
    const std::int64_t side = square.side;
    // In tiles of the square: before the core, along it, after it.
    const auto cuts = [side](std::int64_t begin, std::int64_t end, std::int64_t first) {
        return std::array<std::int64_t, 4>{0, std::clamp<std::int64_t>(begin - first, 0, side),
                                           std::clamp<std::int64_t>(end - first, 0, side), side};
    };
    const auto xs = cuts(core.west, core.east, square.west);
    const auto ys = cuts(core.south, core.north, square.south);
    for (std::size_t v = 0; v < 3; ++v) {
        for (std::size_t u = 0; u < 3; ++u) {
            const Tiles part{xs[u], ys[v], xs[u + 1], ys[v + 1]};
            const bool constant_x = u != 1, constant_y = v != 1;
            if (part.empty() || (!constant_x && !constant_y)) continue;
            const auto row = [&](std::int64_t y) {
                beyond::for_each_extreme(part.west, part.east, y, side,
                                         [&](std::int64_t x) { visit(x, y); });
            };
            const auto column = [&](std::int64_t x) {
                beyond::for_each_extreme(part.south, part.north, x, side,
                                         [&](std::int64_t y) { visit(x, y); });
            };
            if (!constant_y) {
                for (std::int64_t y = part.south; y < part.north; ++y) row(y);
                continue;
            }
            if (!constant_x) {
                for (std::int64_t x = part.west; x < part.east; ++x) column(x);
                continue;
            }
            row(part.south);
            row(part.north - 1);
            column(part.west);
            column(part.east - 1);
            // Around the square's centre, where four triangles meet.
            for (const std::int64_t y : {side / 2 - 1, side / 2}) {
                for (const std::int64_t x : {side / 2 - 1, side / 2}) {
                    const bool is_inside =
                        x >= part.west && x < part.east && y >= part.south && y < part.north;
                    if (is_inside) visit(x, y);
                }
            }
        }
    }
}

}  // namespace terrane::internal
