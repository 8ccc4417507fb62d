// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::internal {

/// How a triangle of a window rises, metres a cell.
struct WindowSlopes {
    double x, y;
};

/// Where in a window something is lifted most: on the triangle on one side of a cell.
struct WindowLift {
    double lift = -std::numeric_limits<double>::infinity();
    int column = 0, row = 0;
    bool is_south = false;
};

/// The heights of a few cells, read once: what questions about small shapes look at many times.
///
/// Places are in cells from its south-western corner; heights in metres over its base.
struct GroundWindow {
    static constexpr int kMostCells = 18;  ///< along a side
    static constexpr int kStride = kMostCells + 1;

    CellRange cells;       ///< lattice; none until it was read
    int columns = 0;       ///< of cells
    int rows = 0;          ///< of cells
    bool is_odd = false;   ///< whether the indices of its first corner have an odd sum
    bool is_full = false;  ///< whether all of its cells are ground
    double high = 0.0;     ///< of its corners, metres
    std::array<std::uint32_t, kMostCells> ground;                       ///< a bit a cell
    std::array<double, static_cast<std::size_t>(kStride) * kStride> z;  ///< of corners, row by row

    static std::size_t index(int column, int row) {
        return static_cast<std::size_t>(row * kStride + column);
    }
    /// Of the vertex at the corner (column, row).
    double at(int column, int row) const { return z[index(column, row)]; }
    /// Whether a cell inside the window is ground.
    bool is_ground(int column, int row) const {
        return is_full || (ground[static_cast<std::size_t>(row)] >> column & 1u) != 0;
    }
    /// Whether the diagonal of a cell runs from its south-western corner to its north-eastern one.
    bool is_cut_to_north_east(int column, int row) const {
        return (((column + row) & 1) != 0) == is_odd;
    }
    /// Of a cell's corners.
    double highest(int column, int row) const {
        return std::max(
            {at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)});
    }
    /// Of a cell's triangle on its southern or northern side.
    WindowSlopes slopes(int column, int row, bool is_south) const {
        const int y = is_south ? row : row + 1;
        const int x = is_south == is_cut_to_north_east(column, row) ? column + 1 : column;
        return {at(column + 1, y) - at(column, y), at(x, row + 1) - at(x, row)};
    }
    bool holds(const CellRange& range) const {
        return range.west >= cells.west && range.east <= cells.east && range.south >= cells.south &&
               range.north <= cells.north;
    }
    /// Whether all cells of a range that it holds are ground.
    bool is_ground(const CellRange& range) const;

    /// Reads a range of cells. False where there are none or more than it holds.
    bool read(GroundReader& reader, const CellRange& range, std::int64_t base, double quantum);
};

}  // namespace terrane::internal
