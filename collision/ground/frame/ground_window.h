// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Slopes of a triangle of a window along x and y, metres per cell.
struct WindowSlopes {
    double x, y;
};

/// The largest lift over a window, and the triangle that it is over: on the southern or northern side of a cell.
struct WindowLift {
    double lift = -std::numeric_limits<double>::infinity();
    int column = 0, row = 0;
    bool is_south = false;
};

/// The heights of a few cells, read once and used by many queries of small shapes.
///
/// Columns and rows count cells from the south-western corner; heights are metres above `base` of read().
struct GroundWindow {
    static constexpr int kMostCells = 18;  ///< along a side
    static constexpr int kStride = kMostCells + 1;

    CellRange cells;       ///< lattice indices; empty until read()
    int columns = 0;       ///< of cells
    int rows = 0;          ///< of cells
    bool is_odd = false;   ///< whether column + row of the south-western corner is odd
    bool is_full = false;  ///< whether all cells are ground
    double high = 0.0;     ///< highest corner, metres
    std::array<std::uint32_t, kMostCells> ground;  ///< a bit per cell: is it ground
    std::array<double, static_cast<std::size_t>(kStride) * kStride>
        z;  ///< heights of corners, row by row

    static std::size_t index(int column, int row) {
        return static_cast<std::size_t>(row * kStride + column);
    }
    /// Height of the vertex (column, row), metres.
    double at(int column, int row) const { return z[index(column, row)]; }
    /// Whether a cell of the window is ground.
    bool is_ground(int column, int row) const {
        return is_full || (ground[static_cast<std::size_t>(row)] >> column & 1u) != 0;
    }
    /// Whether the diagonal of a cell runs from its south-western corner to its north-eastern one.
    bool is_cut_to_north_east(int column, int row) const {
        return (((column + row) & 1) != 0) == is_odd;
    }
    /// Height of a cell's highest corner, metres.
    double highest(int column, int row) const {
        return std::max(
            {at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)});
    }
    /// Slopes of a cell's southern or northern triangle.
    WindowSlopes slopes(int column, int row, bool is_south) const {
        const int y = is_south ? row : row + 1;
        const int x = is_south == is_cut_to_north_east(column, row) ? column + 1 : column;
        return {at(column + 1, y) - at(column, y), at(x, row + 1) - at(x, row)};
    }
    /// Whether a range lies inside the window.
    bool holds(const CellRange& range) const {
        return range.west >= cells.west && range.east <= cells.east && range.south >= cells.south &&
               range.north <= cells.north;
    }
    /// Whether all cells of a range are ground. Requires holds(range).
    bool is_ground(const CellRange& range) const;

    /// Reads the heights of a range of cells. False where it is empty or more than kMostCells along a side.
    ///
    /// @param base    height that z is 0 at, quanta
    /// @param quantum metres
    bool read(GroundReader& reader, const CellRange& range, std::int64_t base, double quantum);
};

}  // namespace terrane::internal
