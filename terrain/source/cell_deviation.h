// SPDX-License-Identifier: MIT
//
// Included by sources that are compiled once for each SimdLevel: plain data, no inline functions.
#pragma once

#include "base/simd_level.h"

namespace terrane::internal {

/// Samples along the side of a cell that deviations are measured at, both ends included.
inline constexpr int kCellSamples = 5;
/// Cells that are measured at once: rows have room for whole groups.
inline constexpr int kCellGroup = 8;

/// Cells of one row that are cut alike, every other one. Each pointer is to values of successive cells.
///
/// Seen so, mirrored where need be, that a cell's diagonal rises from its `foot` in the south-west
/// to its `head`; `right` and `left` are the corners beside it, in the south-east and the north-west.
/// These two are midpoints of spacing s, one of the others is a centre.
struct CellRow {
    int count = 0;               ///< a multiple of kCellGroup
    bool centre_is_foot = true;  ///< or else the head
    bool has_radii = false;
    /// By row and column: the heights there are centre +- radius.
    const double* centres[kCellSamples][kCellSamples];
    const double* radii[kCellSamples][kCellSamples];

    const double *foot, *right, *head, *left;  ///< heights of the corners
    /// How far the heights of vertices are above the middle of their two ends.
    const double *right_rise, *left_rise, *centre_rise;

    /// Largest deviations: raised to what is found. Of the cell's two triangles, and of the triangles
    /// that each of the three vertices splits.
    double *cell, *right_most, *left_most, *centre_most;
};

/// Measures the deviations of samples from the triangles. Every level gives the same bits.
using RaiseDeviations = void (*)(const CellRow& cells);

/// Requires: that this machine runs the level.
RaiseDeviations raise_deviations(SimdLevel level);

extern const RaiseDeviations kRaiseDeviationsBaseline;
#if defined(__x86_64__)
extern const RaiseDeviations kRaiseDeviationsAvx2;
extern const RaiseDeviations kRaiseDeviationsAvx512;
#endif

}  // namespace terrane::internal
