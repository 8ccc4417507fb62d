// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/kinked_surface.h"
#include "bilinear/triangle_deviation.h"

#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Adds a nanometre for the rounding of previous sums, and rounds outward to float. Non-decreasing; 0 at 0.
float round_outward(double deviation);

/// A rectangle of lattice points, with the surface between them and the bounds of the vertices at these points.
///
/// Distances are in units of the window's spacing. The bound of a vertex depends only on the surface within three times
/// (centres) or twice (midpoints) its spacing: two windows that contain this region agree on the bound bit for bit.
struct DiamondWindow {
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point
    int columns = 0, rows = 0;              ///< points
    std::vector<double> heights;            ///< [rows * columns]

    /// The surface over the window, if a cell of the window may overlap several raster cells. Null: over each cell the
    /// surface is the bilinear interpolant of the cell's corners.
    std::shared_ptr<KinkedSurface> kinked;

    /// [(rows - 1) * (columns - 1)] bound of the vertex in the middle of each cell, a vertex of the next finer spacing.
    /// May be empty.
    std::vector<float> middle_bounds;

    /// [rows * columns] bounds of vertices, up to the spacing for which they were computed; otherwise 0.
    std::vector<float> bounds;

    /// [rows], [columns] first of the equal rows, or columns, that end at this one: beyond the raster all are equal.
    /// Empty: none is known to be equal to another one.
    std::vector<int> row_runs, column_runs;

    /// Finds equal rows and columns. The surface must not be kinked: what lies between equal rows depends on x only.
    void find_runs();
    bool has_equal_rows(int first, int last) const {
        return !row_runs.empty() && row_runs[static_cast<std::size_t>(last)] <= first;
    }
    bool has_equal_columns(int first, int last) const {
        return !column_runs.empty() && column_runs[static_cast<std::size_t>(last)] <= first;
    }

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

/// Deviations of rows of edges and squares of a window. They are computed several at a time, with the same bits as one
/// by one. The window must outlive this object, and its heights must not change.
class DeviationRows {
public:
    explicit DeviationRows(const DiamondWindow& window);

    /// Largest deviation over the two triangles that share an edge of length 2 n, along x or y, for the edges with
    /// midpoints (x, y), (x + 2 n, y), (x + 4 n, y) ...
    void edges(int x, int y, int n, bool along_x, std::span<float> deviations_out);
    /// cell_deviation() of the squares (x, y), (x + n, y), (x + 2 n, y) ...
    void squares(int x, int y, int n, std::span<float> deviations_out);

private:
    void arrange(int log2_stride);
    /// Calls compute(first, part of deviations_out) for runs of places x, x + step, ... Places whose columns, from
    /// `before` to the west to `after` to the east, are equal get the deviation of the place before them.
    template <class Compute>
    void skip_equal_columns(int x, int step, int before, int after, std::span<float> deviations_out,
                            const Compute& compute);

    const DiamondWindow& window_;
    FindTriangleDeviations find_deviations_;
    PhasedHeights heights_;
    std::vector<double> values_;
    std::vector<float> every_other_;
};

/// Adds the range of surface minus plane over a triangle that is part of a larger triangle with the same plane.
void add_triangle_part(const DiamondWindow& window, const RightTriangle& t, Range& range);
/// The same over the square of side n whose south-western corner is window point (x, y); the plane has the given
/// heights at that corner, n to the east of it and n to the north of it.
void add_square(const DiamondWindow& window, int x, int y, int n, double at_corner, double at_x_end,
                double at_y_end, Range& range);

/// Range of the true surface minus the bilinear interpolant of the corners of the square of side n whose south-western
/// corner is window point (x, y).
HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n);

/// Computes the bounds of the vertices of spacing 1, 2, 4 ... last_n. Bounds that depend on the surface outside the
/// window are too small.
void compute_bounds(DiamondWindow& window, int last_n);

}  // namespace terrane::internal
