// SPDX-License-Identifier: MIT
//
// How low and how high the true surface may come near a vertex. A vertex is judged by the distance
// from the eye to its reach, and a parent must not seem further away than what is below it: the reach
// of a centre takes in three cells around it, that of a midpoint two, so that flat reaches nest (see
// screen_error.cpp). For heights to nest the intervals of cells are wider than what is certified, by
// as much again: bounds shrink by about half from level to level. Where that is not enough, the
// triangulator sees it.
#include "chunk_reaches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::internal {
namespace {

constexpr double kMargin = 2.0;  // bounds
constexpr int kLargest = 32000;  // units

std::size_t wide_index(int column, int row) {
    return static_cast<std::size_t>(row) * kWideCells + static_cast<std::size_t>(column);
}

// Squares of cells hold their lowest value where their south-western cell is: makes them wider by
// `more` cells, as much as they are at most. What reaches beyond the chunk's surroundings is not used.
std::vector<float> widen(const std::vector<float>& squares, int more) {
    std::vector<float> across(squares);
    for (int row = 0; row < kWideCells; ++row) {
        for (int i = 0; i + more < kWideCells; ++i) {
            across[wide_index(i, row)] =
                std::min(squares[wide_index(i, row)], squares[wide_index(i + more, row)]);
        }
    }
    std::vector<float> both(across);
    for (int row = 0; row + more < kWideCells; ++row) {
        for (int i = 0; i < kWideCells; ++i) {
            both[wide_index(i, row)] =
                std::min(across[wide_index(i, row)], across[wide_index(i, row + more)]);
        }
    }
    return both;
}

// The lowest value over the reach of a vertex at a sample.
struct Lowest {
    std::vector<float> of_midpoint, of_centre;

    explicit Lowest(const std::vector<float>& cells)
        : of_midpoint(widen(widen(cells, 1), 2)), of_centre(widen(of_midpoint, 2)) {}
    float at(int column, int row) const {
        return (column & row & 1) != 0 ? of_centre[wide_index(column - 1, row - 1)]
                                       : of_midpoint[wide_index(column, row)];
    }
};

// In single precision, towards the outside.
float round_down(double value) {
    const auto rounded = static_cast<float>(value);
    return static_cast<double>(rounded) > value
               ? std::nextafter(rounded, -std::numeric_limits<float>::infinity())
               : rounded;
}

}  // namespace

void fill_reaches(std::span<const double> heights, std::span<const float> bounds, Chunk& chunk) {
    // metres above the chunk's middle
    const double middle = std::floor(0.5 * (heights.front() + heights.back()));
    std::vector<float> lows(bounds.size()), highs_negated(bounds.size());
    float lowest = 0.0f, highest_negated = 0.0f;
    for (int row = 0; row < kWideCells; ++row) {
        for (int column = 0; column < kWideCells; ++column) {
            const std::size_t cell = wide_index(column, row);
            const double* corner = heights.data() + row * kWideSamples + column;
            const auto [low, high] =
                std::minmax({corner[0], corner[1], corner[kWideSamples], corner[kWideSamples + 1]});
            const double margin = kMargin * static_cast<double>(bounds[cell]);
            lows[cell] = round_down(low - middle - margin);
            highs_negated[cell] = round_down(middle - high - margin);
            lowest = std::min(lowest, lows[cell]);
            highest_negated = std::min(highest_negated, highs_negated[cell]);
        }
    }
    // one unit more on both sides takes up the rounding of sums with the eye's height
    chunk.reach_base = middle;
    chunk.reach_unit = 0x1p-20f;
    while (std::min(lowest, highest_negated) < -kLargest * chunk.reach_unit) chunk.reach_unit *= 2;
    const auto to_units = [&](float low) {
        return static_cast<std::int16_t>(std::floor(low / chunk.reach_unit) - 1.0f);
    };
    const Lowest low_of(lows), high_of(highs_negated);
    chunk.reach_low = std::numeric_limits<std::int16_t>::max();
    chunk.reach_high = std::numeric_limits<std::int16_t>::min();
    for (Chunk::Area& area : chunk.areas) {
        area.reach_low = chunk.reach_low;
        area.reach_high = chunk.reach_high;
    }
    const auto fill = [&](int column, int row, std::int16_t& low, std::int16_t& high) {
        low = to_units(low_of.at(column, row));
        high = static_cast<std::int16_t>(-to_units(high_of.at(column, row)));
        chunk.reach_low = std::min(chunk.reach_low, low);
        chunk.reach_high = std::max(chunk.reach_high, high);
        for (int y = std::max(0, (row - 1) / kAreaCells);
             y <= std::min(kChunkAreas - 1, row / kAreaCells); ++y) {
            for (int x = std::max(0, (column - 1) / kAreaCells);
                 x <= std::min(kChunkAreas - 1, column / kAreaCells); ++x) {
                Chunk::Area& area = chunk.areas[static_cast<std::size_t>(y * kChunkAreas + x)];
                area.reach_low = std::min(area.reach_low, low);
                area.reach_high = std::max(area.reach_high, high);
            }
        }
    };
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < kChunkCells;
             column += row % 2 == 0 ? 2 : 1) {
            const auto [area, kind, square] = AreaVertices::find(column, row);
            AreaVertices& vertices = chunk.vertices[area];
            fill(column, row, vertices.low[kind][square], vertices.high[kind][square]);
        }
    }
    for (int i = 0; i < kChunkSquares; ++i) {
        const auto k = static_cast<std::size_t>(i);
        fill(kChunkCells, 2 * i + 1, chunk.east_side.low[k], chunk.east_side.high[k]);
        fill(2 * i + 1, kChunkCells, chunk.north_side.low[k], chunk.north_side.high[k]);
    }
}

}  // namespace terrane::internal
