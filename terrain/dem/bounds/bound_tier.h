// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Points of a tier beyond the raster: a vertex there depends on three points around it, and all four residues modulo 4
/// must occur.
inline constexpr std::int64_t kBeyondRaster = 6;

/// A decimated lattice over a raster with bounds of the surface at its spacing. Beyond the raster the surface repeats
/// its edge, so that a point out there has the values of the one just beyond the edge with the same index modulo 4:
/// their squares are cut along the same diagonals.
struct BoundTier {
    std::int64_t step = 1;                  ///< finest spacings between its points
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point, in steps
    int columns = 0, rows = 0;
    std::vector<float> bounds;       ///< [rows * columns] of the vertices of spacing `step`; else 0
    std::vector<float> cell_bounds;  ///< of the two triangles of the cell north-east of a point

    // First tier only.
    std::vector<double> heights;  ///< [rows * columns]
    /// [rows * columns] range of the surface minus the bilinear interpolation of the corners, over the cell
    /// north-east of a point.
    std::vector<float> cell_low, cell_high;

    bool contains(std::int64_t x, std::int64_t y) const {
        return x >= first_x && y >= first_y && x < first_x + columns && y < first_y + rows;
    }
    std::size_t at(std::int64_t x, std::int64_t y) const {
        return static_cast<std::size_t>(repeated(y - first_y, rows)) *
                   static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(repeated(x - first_x, columns));
    }

private:
    static std::int64_t repeated(std::int64_t i, std::int64_t count) {
        if (i < 0) return i & 3;
        if (i >= count) return count - 4 + ((i - count) & 3);
        return i;
    }
};

}  // namespace terrane::internal
