// SPDX-License-Identifier: MIT
//
// Included by sources that are compiled once for each SimdLevel: plain data, no inline functions.
#pragma once

#include "base/simd_level.h"

namespace terrane::internal {

/// Samples along the side of a cell at which deviations are measured, both ends included.
inline constexpr int kCellSamples = 5;
/// Cells that are measured at once: rows are padded to whole groups.
inline constexpr int kCellGroup = 8;

/// Every other cell of one row: cells with the same diagonal. Each pointer is to values of successive cells.
///
/// Cells are mirrored if necessary, so that the diagonal rises from the south-western corner, `foot`, to the
/// north-eastern corner, `head`; `right` and `left` are the south-eastern and the north-western corner. `right` and
/// `left` are midpoints of spacing s, and `foot` or `head` is a centre.
struct CellRow {
    int count = 0;               ///< a multiple of kCellGroup
    bool centre_is_foot = true;  ///< else the centre is the head
    bool has_radii = false;
    /// By row and column: the heights at a sample are centre +- radius.
    const double* centres[kCellSamples][kCellSamples];
    const double* radii[kCellSamples][kCellSamples];

    const double *foot, *right, *head, *left;  ///< heights of the corners
    /// Heights of vertices above the middle of their two ends.
    const double *right_rise, *left_rise, *centre_rise;

    /// Largest deviations so far, raised to those that are measured: from the cell's two triangles, and from the
    /// triangles that each of the three vertices splits.
    double *cell, *right_most, *left_most, *centre_most;
};

/// Measures the deviations of samples from the triangles. All levels give the same bits.
using FindMaxDeviations = void (*)(const CellRow& cells);

/// Requires a level that this machine supports.
FindMaxDeviations find_max_deviations(SimdLevel level);

extern const FindMaxDeviations kFindMaxDeviationsBaseline;
#if defined(__x86_64__)
extern const FindMaxDeviations kFindMaxDeviationsAvx2;
extern const FindMaxDeviations kFindMaxDeviationsAvx512;
#endif

}  // namespace terrane::internal
