// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tier.h"
#include "surface/kinked_surface.h"

#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace terrane::internal {

/// Tiles, the cells of the first tier, along the side of a block.
inline constexpr int kBlockTiles = 8;

/// Heights over a square: at its south-western corner and how they rise from tile to tile.
struct Plane {
    double corner = 0.0, rise_x = 0.0, rise_y = 0.0;
    double at(std::int64_t x, std::int64_t y) const {
        return corner + (static_cast<double>(x) * rise_x + static_cast<double>(y) * rise_y);
    }
};

/// The plane of a triangle and the output of its deviation; null: not needed.
struct Target {
    Plane plane;
    float* deviation = nullptr;
    double found = 0.0;  ///< in this block
    float known = 0.0f;  ///< so far, rounded outward
};

/// The half of a tile with its right angle at this corner, or the whole tile.
enum class Part { whole, south_west, south_east, north_west, north_east };

/// A square of a level, cut into the two triangles of its cell, and into four from its centre, which are halves of the
/// diamonds of the midpoints of its sides: vertices of half its side.
struct Square {
    std::int64_t west = 0, south = 0, side = 0;  ///< tiles
    bool is_cut_north_east = false;
    Target lower, upper;  ///< south and north of the diagonal
    Target south_side, east_side, north_side, west_side;

    std::array<Target*, 6> targets() {
        return {&lower, &upper, &south_side, &east_side, &north_side, &west_side};
    }
};

/// The square of a level whose south-western corner has the indices i, j.
///
/// @param levels  as find_deviations()
Square make_square(const BoundTier& first, std::span<BoundTier> levels, std::size_t level,
                   std::int64_t i, std::int64_t j);

/// Surface minus plane at the corners of a part of a tile, the tile at (x, y) of the plane's square.
///
/// @param heights  south-west, south-east, north-west, north-east
Range corner_range(const std::array<double, 4>& heights, const Plane& plane, std::int64_t x,
                   std::int64_t y, Part part);

/// Visits the triangles of a square that contain a tile or a half of it.
///
/// @param x, y   position of the tile in the square
/// @param visit  called with Part, Target&
template <typename Visit>
void for_each_part_of_tile(Square& square, std::int64_t x, std::int64_t y, Visit&& visit) {
    const auto add = [&](Target& target, Part part) {
        if (target.deviation != nullptr) visit(part, target);
    };
    // Above 0: north of the diagonal.
    const std::int64_t rising = y - x, falling = y + x - (square.side - 1);
    const std::int64_t cut = square.is_cut_north_east ? rising : falling;
    if (cut != 0) {
        add(cut < 0 ? square.lower : square.upper, Part::whole);
    } else {
        add(square.lower, square.is_cut_north_east ? Part::south_east : Part::south_west);
        add(square.upper, square.is_cut_north_east ? Part::north_west : Part::north_east);
    }
    if (rising < 0 && falling < 0) add(square.south_side, Part::whole);
    if (rising > 0 && falling > 0) add(square.north_side, Part::whole);
    if (rising > 0 && falling < 0) add(square.west_side, Part::whole);
    if (rising < 0 && falling > 0) add(square.east_side, Part::whole);
    if (rising == 0) {
        add(falling < 0 ? square.south_side : square.east_side, Part::south_east);
        add(falling < 0 ? square.west_side : square.north_side, Part::north_west);
    }
    if (falling == 0) {
        add(rising < 0 ? square.south_side : square.west_side, Part::south_west);
        add(rising < 0 ? square.east_side : square.north_side, Part::north_east);
    }
}

/// Visits the tiles of a square within a block, for each triangle that contains them or a half.
///
/// @param block  its south-western tile
/// @param visit  called with column and row in the block, Part, Target&
template <typename Visit>
void for_each_part(LatticePoint block, Square& square, Visit&& visit) {
    const auto begin = [](std::int64_t of_block, std::int64_t of_square) {
        return static_cast<int>(std::max<std::int64_t>(of_square - of_block, 0));
    };
    const auto end = [&](std::int64_t of_block, std::int64_t of_square) {
        return static_cast<int>(
            std::min<std::int64_t>(of_square + square.side - of_block, kBlockTiles));
    };
    for (int row = begin(block.y, square.south); row < end(block.y, square.south); ++row) {
        const std::int64_t y = block.y + row - square.south;
        for (int column = begin(block.x, square.west); column < end(block.x, square.west);
             ++column) {
            const std::int64_t x = block.x + column - square.west;
            for_each_part_of_tile(
                square, x, y, [&](Part part, Target& target) { visit(column, row, part, target); });
        }
    }
}

}  // namespace terrane::internal
