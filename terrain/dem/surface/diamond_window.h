// SPDX-License-Identifier: MIT
#pragma once

#include "surface/kinked_surface.h"

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Rounds a deviation outward to float, plus a nanometre for the rounding of the sums before. Not decreasing; 0 at 0.
float round_outward(double deviation);

/// A rectangle of lattice points with the surface between them, and the bounds of the triangulation's vertices at the
/// points.
///
/// Distances are in the window's spacing. The bound of a vertex depends only on what lies within three times its
/// spacing (a centre) or twice (a midpoint): two windows that contain that agree bit for bit.
struct DiamondWindow {
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point
    int columns = 0, rows = 0;              ///< points
    std::vector<double> heights;            ///< [rows * columns]

    /// The surface over the window if its cells may overlap several raster cells; null if the surface is the bilinear
    /// interpolation of each cell's corners.
    std::shared_ptr<KinkedSurface> kinked;

    /// [(rows - 1) * (columns - 1)] bound of the vertex in the middle of each cell, one of a finer lattice. Empty if
    /// there is none.
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

/// Largest deviation of the surface from the two triangles of the square of side n whose south-western corner is window
/// point (x, y). Requires x and y to be multiples of n, and the square to lie in the window.
float cell_deviation(const DiamondWindow& window, int x, int y, int n);

/// Adds the range of surface minus plane over a triangle that is part of a larger one.
void add_triangle_part(const DiamondWindow& window, const RightTriangle& t, Range& range);
/// The same over the square of side n whose south-western corner is window point (x, y); the plane's
/// heights are those at that corner, n to the east and n to the north.
void add_square(const DiamondWindow& window, int x, int y, int n, double at_corner, double at_x_end,
                double at_y_end, Range& range);

/// Range of the true surface minus the bilinear interpolation of the corners of the square of side n whose
/// south-western corner is window point (x, y).
HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n);

/// Computes the bounds of the vertices of spacing 1, 2, 4 ... last_n. Those of vertices whose dependencies leave the
/// window are too small.
void compute_bounds(DiamondWindow& window, int last_n);

}  // namespace terrane::internal
