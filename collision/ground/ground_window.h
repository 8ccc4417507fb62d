// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace terrane::internal {

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

    double at(int column, int row) const {
        return z[static_cast<std::size_t>(row) * kStride + static_cast<std::size_t>(column)];
    }
    /// Whether a cell inside the window is ground.
    bool is_ground(int column, int row) const {
        return is_full || (ground[static_cast<std::size_t>(row)] >> column & 1u) != 0;
    }
    /// Whether the diagonal of a cell runs from its south-western corner to its north-eastern one.
    bool is_cut_to_north_east(int column, int row) const {
        return (((column + row) & 1) != 0) == is_odd;
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
