// SPDX-License-Identifier: MIT
#pragma once

#include "kinked_surface.h"

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Rounds a deviation outward to float. Not decreasing, 0 at 0; a nanometre covers the rounding of
/// the sums that led there.
float round_outward(double deviation);

/// A rectangle of lattice points with what is known about the surface between them, and the bounds
/// of the vertices of the triangulation among them.
///
/// Distances are counted in the spacing of the window. Bounds of a vertex depend on what lies within
/// three times its spacing (a centre) or twice (a midpoint), and on nothing else: two windows that
/// both hold that much agree bit for bit.
struct DiamondWindow {
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point
    int columns = 0, rows = 0;              ///< points
    std::vector<double> heights;            ///< [rows * columns]

    /// [(rows - 1) * (columns - 1)] least and greatest of the true surface minus the bilinear
    /// interpolation of a cell's corners. Empty: the surface is that interpolation, or `kinked`.
    std::vector<float> cell_low, cell_high;

    /// The surface over the window, where its cells hold parts of several raster cells; else null.
    std::shared_ptr<KinkedSurface> kinked;

    /// [(rows - 1) * (columns - 1)] bound of the vertex in the middle of each cell, which belongs to
    /// a finer lattice. Empty: there is none.
    std::vector<float> middle_bounds;

    /// [rows * columns] e(v) of the vertices up to the spacing that was computed; elsewhere 0.
    std::vector<float> bounds;

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(x);
    }
    std::size_t cell_at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns - 1) +
               static_cast<std::size_t>(x);
    }
};

/// How far the surface leaves the two triangles of the square of side 2 * n around window point
/// (x, y), an odd multiple of n both ways. The square must lie in the window.
float square_deviation(const DiamondWindow& window, int x, int y, int n);

/// Greatest and least of the true surface minus the bilinear interpolation of the corners of the
/// square of side n whose south-western corner is window point (x, y).
HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n);

/// Fills in the bounds of the vertices of spacing first_n, 2 * first_n ... last_n. Those of spacing
/// first_n / 2 must be there. Vertices nearer to the window's edge than they depend on get less than
/// their bound.
void compute_bounds(DiamondWindow& window, int first_n, int last_n);

}  // namespace terrane::internal
