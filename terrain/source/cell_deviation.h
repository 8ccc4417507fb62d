// SPDX-License-Identifier: MIT
//
// Included by sources that are compiled once for each SimdLevel: contains only plain data, no inline functions.
#pragma once

#include "base/simd_level.h"

namespace terrane::internal {

/// Number of points along a side of a cell, ends included, at which deviations are measured.
inline constexpr int kCellSamples = 5;
/// Number of cells that are measured at once; rows are padded to a multiple of it.
inline constexpr int kCellGroup = 8;

/// Every other cell of one row: cells with the same diagonal. Each pointer is to an array with one value per cell.
///
/// Cells are mirrored if necessary, so that the diagonal rises from the south-western corner, `foot`, to the
/// north-eastern corner, `head`; `right` and `left` are the south-eastern and the north-western corner. At the spacing
/// s of the cells, `right` and `left` are midpoints, and either `foot` or `head` is a centre.
struct CellRow {
    int count = 0;               ///< a multiple of kCellGroup
    bool centre_is_foot = true;  ///< else the centre is the head
    bool has_radii = false;
    /// [row][column]: the heights at a point are within centre +- radius.
    const double* centres[kCellSamples][kCellSamples];
    const double* radii[kCellSamples][kCellSamples];

    const double *foot, *right, *head, *left;  ///< heights of the corners
    /// Height of a vertex above the mean height of its two ends.
    const double *right_rise, *left_rise, *centre_rise;

    /// Largest deviations so far, raised to the measured ones where these are larger: `cell` from the cell's two
    /// triangles, the others from the triangles that the corner `right`, the corner `left` or the centre splits.
    double *cell, *right_most, *left_most, *centre_most;
};

/// Measures the deviations of samples from the triangles. Results are bit-identical at all levels.
using FindMaxDeviations = void (*)(const CellRow& cells);

/// Requires a level that this machine supports.
FindMaxDeviations find_max_deviations(SimdLevel level);

extern const FindMaxDeviations kFindMaxDeviationsBaseline;
#if defined(__x86_64__)
extern const FindMaxDeviations kFindMaxDeviationsAvx2;
extern const FindMaxDeviations kFindMaxDeviationsAvx512;
#endif

}  // namespace terrane::internal
