// SPDX-License-Identifier: MIT
#pragma once

#include "surface/kinked_surface.h"

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

    /// The surface over the window, where its cells hold parts of several raster cells; null: it is the
    /// bilinear interpolation of each cell's corners.
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

/// How far the surface leaves the two triangles of the square of side n whose south-western corner is
/// window point (x, y), a multiple of n both ways. The square must lie in the window.
float cell_deviation(const DiamondWindow& window, int x, int y, int n);

/// Adds the range of surface minus plane over a triangle that is part of a larger one.
void add_triangle_part(const DiamondWindow& window, const RightTriangle& t, Range& range);
/// The same over the square of side n whose south-western corner is window point (x, y); the plane's
/// heights are those at that corner, n to the east and n to the north.
void add_square(const DiamondWindow& window, int x, int y, int n, double at_corner, double at_x_end,
                double at_y_end, Range& range);

/// Greatest and least of the true surface minus the bilinear interpolation of the corners of the
/// square of side n whose south-western corner is window point (x, y).
HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n);

/// Fills in the bounds of the vertices of spacing 1, 2, 4 ... last_n. Vertices nearer to the window's
/// edge than they depend on get less than their bound.
void compute_bounds(DiamondWindow& window, int last_n);

}  // namespace terrane::internal
