// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Number of points per kernel call.
inline constexpr std::size_t kHeightBlock = 64;

/// The lines between cells along one axis (Ground::Lines), and the valid range of the axis.
struct AxisLines {
    double origin = 0.0, spacing = 1.0, inverse_spacing = 1.0;
    double low = 0.0, high = 0.0;    ///< ends of the extent, inclusive, metres
    double first = 0.0, last = 0.0;  ///< indices of the first and the last cell
};

/// The cells of a block along one axis.
struct AxisCells {
    alignas(64) double place[kHeightBlock];        ///< in the cell, 0 to 1 from its lower line
    alignas(64) std::int32_t chunk[kHeightBlock];  ///< index of the chunk
    alignas(
        64) std::int32_t cell[kHeightBlock];  ///< in the chunk; -1 beyond the extent and for NaN
};

/// Heights of a block.
struct BlockHeights {
    alignas(64) double height[kHeightBlock];  ///< world z, metres
    alignas(64) double slope_x[kHeightBlock],
        slope_y[kHeightBlock];  ///< rise along one cell, metres
};

/// Unit normals of a block, upwards.
struct BlockNormals {
    alignas(64) double x[kHeightBlock], y[kHeightBlock], z[kHeightBlock];
};

/// Loops over the points of a block, compiled for each vector width. Their results are bit-identical to those of
/// Ground::Lines::last_up_to() and height_in_cell().
struct HeightKernels {
    /// @param p  [kHeightBlock] positions along the axis, metres; any values
    void (*find_cells)(const AxisLines& lines, const double* p, AxisCells& out);
    /// @param south_west  [kHeightBlock] samples of the cells' south-west corners in Chunk::heights
    void (*heights)(const std::int32_t* const* south_west, const AxisCells& x, const AxisCells& y,
                    double quantum, BlockHeights& out);
    void (*normals)(const BlockHeights& heights, double spacing, BlockNormals& out);
};

/// The kernels of a SIMD level, or of the next lower level that is built.
const HeightKernels& height_kernels(SimdLevel level);

}  // namespace terrane::internal
