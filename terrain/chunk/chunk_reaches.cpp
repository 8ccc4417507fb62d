// SPDX-License-Identifier: MIT
//
// Height intervals of the reaches of vertices. The key of a vertex depends on the distance from the eye to its reach.
// This distance must not be smaller for a child than for its parent, so reaches must be nested. In plan they are: a
// reach extends three cells around a centre and two around a midpoint (see screen_error.cpp). To nest them in height as
// well, the certified bounds of cells are doubled, because bounds shrink by about half from level to level. If this
// does not suffice, the triangulator raises a child's key to its parent's (kNestMargin). The rise bound of the source
// limits the intervals too.
#include "chunk/chunk_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::internal {
namespace {

constexpr double kMargin = 2.0;  // factor on the bounds of cells
constexpr int kLargest = 32000;  // largest stored value, in units

std::size_t wide_index(int column, int row) {
    return static_cast<std::size_t>(row) * kWideCells + static_cast<std::size_t>(column);
}

// From minima over squares of cells, computes minima over squares with sides longer by `more` cells, at most twice as
// long. A minimum is stored at its square's south-western cell. Squares that extend beyond the surroundings are unused.
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

// Lowest values over the reaches of vertices.
struct Lowest {
    std::vector<float> of_midpoint, of_centre;

    explicit Lowest(const std::vector<float>& cells)
        : of_midpoint(widen(widen(cells, 1), 2)), of_centre(widen(of_midpoint, 2)) {}
    float at(int column, int row) const {
        return (column & row & 1) != 0 ? of_centre[wide_index(column - 1, row - 1)]
                                       : of_midpoint[wide_index(column, row)];
    }
};

// Converts to a float that is at most the value.
float round_down(double value) {
    const auto rounded = static_cast<float>(value);
    return rounded - std::abs(rounded) * 0x1p-22f;
}

// Height intervals of cells, widened by their margins, relative to the mean height of two opposite corners.
struct Depths {
    double middle = 0.0;  // metres
    std::vector<float> down,
        up;             // [kWideCells^2] low - middle and middle - high of each cell, metres
    float most = 0.0f;  // largest absolute value, metres

    Depths(std::span<const double> heights, std::span<const float> bounds)
        : middle(std::floor(0.5 * (heights.front() + heights.back()))),
          down(bounds.size()),
          up(bounds.size()) {
        for (int row = 0; row < kWideCells; ++row) {
            const double* south = heights.data() + std::ptrdiff_t{row} * kWideSamples;
            const double* north = south + kWideSamples;
            for (int i = 0; i < kWideCells; ++i) {
                const std::size_t cell = wide_index(i, row);
                const double low =
                    std::min(std::min(south[i], south[i + 1]), std::min(north[i], north[i + 1]));
                const double high =
                    std::max(std::max(south[i], south[i + 1]), std::max(north[i], north[i + 1]));
                const double margin = kMargin * static_cast<double>(bounds[cell]);
                down[cell] = round_down(low - middle - margin);
                up[cell] = round_down(middle - high - margin);
                most = std::max(most, std::max(-down[cell], -up[cell]));
            }
        }
    }
};

// Computes the unions of reaches over areas and over the chunk.
void enclose_reaches(ChunkVertices& vertices, Chunk& chunk) {
    using AreaReach = ChunkVertices::AreaReach;
    constexpr AreaReach kEmpty{std::numeric_limits<std::int16_t>::max(),
                               std::numeric_limits<std::int16_t>::min()};
    const auto add = [](AreaReach& reach, const auto& lows, const auto& highs) {
        for (const std::int16_t low : lows) reach.low = std::min(reach.low, low);
        for (const std::int16_t high : highs) reach.high = std::max(reach.high, high);
    };
    AreaReach all = kEmpty;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        AreaReach& reach = vertices.area_reaches[static_cast<std::size_t>(i)];
        const AreaVertices& area = vertices.areas[static_cast<std::size_t>(i)];
        reach = kEmpty;
        for (std::size_t kind = 0; kind < AreaVertices::kKinds; ++kind) {
            add(reach, area.low[kind], area.high[kind]);
        }
        if (i % kChunkAreas == kChunkAreas - 1) {
            add(reach, vertices.east_side.low, vertices.east_side.high);
        }
        if (i / kChunkAreas == kChunkAreas - 1) {
            add(reach, vertices.north_side.low, vertices.north_side.high);
        }
        add(all, std::array{reach.low}, std::array{reach.high});
    }
    chunk.vertex_reach = vertices.metres(all.low, all.high);
}

// Twice the height of a vertex above the middle of the edge that it splits, quanta.
std::int64_t double_rise(const Chunk& chunk, int column, int row) {
    const auto height = [&](int x, int y) {
        return std::int64_t{chunk.heights[sample_index(x, y)]};
    };
    // the diagonal of an even square rises from its south-western corner
    const bool rises = (column / 2 + row / 2) % 2 == 0;
    const int to_x = column % 2, to_y = row % 2 == 0 ? 0 : column % 2 == 0 || rises ? 1 : -1;
    return 2 * height(column, row) - height(column - to_x, row - to_y) -
           height(column + to_x, row + to_y);
}

void fill_rises(double quantum, const Chunk& chunk, int area, AreaVertices& vertices) {
    const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
    AreaVertices::PerVertex<std::int64_t> rises;
    std::int64_t most = 0;
    for (int square = 0; square < static_cast<int>(AreaVertices::kSquares); ++square) {
        const int column = west + 2 * (square % kAreaSquares);
        const int row = south + 2 * (square / kAreaSquares);
        const auto k = static_cast<std::size_t>(square);
        rises[AreaVertices::centre][k] = double_rise(chunk, column + 1, row + 1);
        rises[AreaVertices::along_x][k] = double_rise(chunk, column + 1, row);
        rises[AreaVertices::along_y][k] = double_rise(chunk, column, row + 1);
        for (const auto& of_kind : rises) most = std::max(most, std::abs(of_kind[k]));
    }
    int shift = 0;
    while (most >> shift > kLargest) ++shift;
    vertices.rise_unit = static_cast<float>(std::ldexp(0.5 * quantum, shift));
    for (std::size_t kind = 0; kind < AreaVertices::kKinds; ++kind) {
        for (std::size_t k = 0; k < AreaVertices::kSquares; ++k) {
            vertices.rise[kind][k] = static_cast<std::int16_t>(rises[kind][k] >> shift);
        }
    }
}

}  // namespace

ReachHeights reach_heights(const HeightSource& source, double spacing) {
    constexpr double kDiagonal = 0.70710678118654757;
    // sums over all descendants, including those below the finest spacing
    const double smallest = std::ldexp(source.lattice().spacing, -24);
    ReachHeights reach;
    double of_children = 0.0;
    for (double s = smallest; s <= spacing; s *= 2.0) {
        const auto rise = [&](double distance) {
            const double most = source.rise_bound(distance);
            // an invalid bound is replaced by the largest possible difference
            return (most >= 0.0 && most < 2.0 * kMostHeight ? most : 2.0 * kMostHeight) +
                   source.lattice().quantum;
        };
        reach.of_midpoint = rise(kDiagonal * s) + of_children;
        reach.of_centre = rise(s) + reach.of_midpoint;
        of_children = reach.of_centre;
    }
    return reach;
}

void fill_reaches(std::span<const double> heights, std::span<const float> bounds,
                  const HeightSource& source, const Chunk& chunk, ChunkVertices& vertices_out) {
    const double quantum = source.lattice().quantum;
    const ReachHeights most =
        reach_heights(source, source.lattice().spacing * static_cast<double>(chunk.step));
    const Depths depths(heights, bounds);
    vertices_out.reach_base = depths.middle;
    vertices_out.reach_unit = 0x1p-20f;
    while (depths.most > kLargest * vertices_out.reach_unit) vertices_out.reach_unit *= 2;
    const Lowest down(depths.down), up(depths.up);
    const float per_unit = 1.0f / vertices_out.reach_unit;
    // truncating and subtracting two units rounds down, with a margin for the rounding of sums with the eye's height
    const auto to_units = [&](float depth) {
        return static_cast<std::int16_t>(static_cast<int>(depth * per_unit) - 2);
    };
    const auto fill = [&](int column, int row, std::int16_t& low, std::int16_t& high) {
        const double z = quantum * chunk.heights[sample_index(column, row)] - depths.middle;
        const double reach = (column & row & 1) != 0 ? most.of_centre : most.of_midpoint;
        low = to_units(std::max(down.at(column, row), round_down(z - reach)));
        high = static_cast<std::int16_t>(
            -to_units(std::max(up.at(column, row), round_down(-z - reach))));
    };
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < kChunkCells;
             column += row % 2 == 0 ? 2 : 1) {
            const auto [area, kind, square] = AreaVertices::address_of(column, row);
            AreaVertices& of_area = vertices_out.areas[area];
            fill(column, row, of_area.low[kind][square], of_area.high[kind][square]);
        }
    }
    for (int i = 0; i < kChunkSquares; ++i) {
        const auto k = static_cast<std::size_t>(i);
        fill(kChunkCells, 2 * i + 1, vertices_out.east_side.low[k], vertices_out.east_side.high[k]);
        fill(2 * i + 1, kChunkCells, vertices_out.north_side.low[k],
             vertices_out.north_side.high[k]);
    }
}

void derive_reaches(double quantum, ChunkVertices& vertices, Chunk& chunk) {
    enclose_reaches(vertices, chunk);
    for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
        fill_rises(quantum, chunk, area, vertices.areas[static_cast<std::size_t>(area)]);
    }
}

}  // namespace terrane::internal
