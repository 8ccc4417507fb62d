// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::internal {

/// Range of the added values.
struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    void add(double value) {
        low = value < low ? value : low;
        high = value > high ? value : high;
    }
    void add(const Range& other) {
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    }
    double deviation() const { return std::max(high, -low); }
};

/// A right triangle with legs along the axes: corner, signs and length of the legs, and the plane's heights at the
/// corner and at the ends of the legs along x and y.
struct RightTriangle {
    int x, y;
    int sign_x, sign_y;
    int leg;
    double at_corner, at_x_end, at_y_end;
};

/// The bilinear surface of a raster whose samples are not lattice points, evaluated over a grid of lattice points.
/// Points are counted from the grid's corner in steps of the grid; values depend only on a point's lattice address.
///
/// *Lines* separate the raster cells; they intersect at the samples.
/// Threads: any number may make const calls at once; keep_diagonals() alone.
class KinkedSurface {
public:
    /// @param patch the samples around `points`, with one more line on every side
    KinkedSurface(const BilinearGrid& grid, const SampleGrid& points, RasterPatch patch);

    /// Caches the surface along the diagonals of the squares of side n at multiples of n, between corners of even index
    /// sum. Afterwards a triangle with legs of n must be half of such a square. Call in order n = 1, 2, 4 ...
    void keep_diagonals(int n);

    /// Adds the range of surface minus plane over a triangle. Requires that both are equal at the ends of the
    /// hypotenuse.
    void add_triangle(const RightTriangle& t, Range& range) const;

    /// The same without that requirement, for a part of a larger triangle with the same plane.
    void add_part(const RightTriangle& t, Range& range) const;

    /// The same over the square of side n whose south-western corner is point (x, y); the plane has the given heights
    /// at that corner, n to the east of it and n to the north of it.
    void add_square(int x, int y, int n, double at_corner, double at_x_end, double at_y_end,
                    Range& range) const;

    /// Range of the surface minus the bilinear interpolant of the corners of the square of side n whose south-western
    /// corner is point (x, y).
    Range bilinear_deviation(int x, int y, int n) const;

private:
    /// Cached diagonals of the squares of one side.
    struct Diagonals {
        int x = 0, y = 0;  ///< the south-western square's corner
        int columns = 0;
        std::vector<Range> ranges;
    };
    /// The lines along one axis: positions in steps from the lattice's origin, and indices at the points.
    struct Axis {
        std::int64_t first = 0;     ///< the first point
        double per_cell = 1.0;      ///< raster cells in a step
        std::vector<double> lines;  ///< increasing
        std::vector<int> at_or_after,
            after;  ///< [points] first line at or after the point, and first line after it

        double point(int i) const { return static_cast<double>(first + i); }
    };
    /// @param place_of position of a line by index, in steps from the lattice's origin
    template <typename PlaceOf>
    static Axis make_axis(std::int64_t first, int points, std::int64_t first_line, int lines,
                          double per_cell, PlaceOf&& place_of);

    double sample(int c, int r) const {
        return patch_
            .samples[static_cast<std::size_t>(r) * static_cast<std::size_t>(patch_.columns) +
                     static_cast<std::size_t>(c)];
    }
    double on_row(int y, int c) const {
        return on_rows_[static_cast<std::size_t>(y) * static_cast<std::size_t>(patch_.columns) +
                        static_cast<std::size_t>(c)];
    }
    double on_column(int x, int r) const {
        return on_columns_[static_cast<std::size_t>(x) * static_cast<std::size_t>(patch_.rows) +
                           static_cast<std::size_t>(r)];
    }
    double height(int c, int r, double x, double y) const {
        const double fx = (x - x_.lines[static_cast<std::size_t>(c)]) * x_.per_cell;
        const double fy = (y - y_.lines[static_cast<std::size_t>(r)]) * y_.per_cell;
        const double* south =
            patch_.samples.data() + static_cast<std::ptrdiff_t>(r) * patch_.columns + c;
        const double* north = south + patch_.columns;
        return bilinear(south[0], south[1], north[0], north[1], fx, fy);
    }
    double point_height(int x, int y) const {
        return heights_[static_cast<std::size_t>(y) * x_.after.size() +
                        static_cast<std::size_t>(x)];
    }
    /// Adds surface minus plane at the right-angled corner, where the legs cross lines, and at the samples inside.
    void add_legs_and_inside(const RightTriangle& t, Range& range) const;
    /// Range of the surface minus a chord along the diagonal from (x, y) to the point n steps to the east and n to the
    /// north, or south; the chord has the given heights at its ends.
    Range diagonal(int x, int y, int n, bool north, double begin_height, double end_height) const;

    RasterPatch patch_;
    Axis x_, y_;
    /// Heights of the surface where rows of points cross lines along y, and where columns cross lines along x.
    std::vector<double> on_rows_, on_columns_;
    std::vector<double> heights_;       ///< [rows * columns] at the points
    std::vector<Diagonals> diagonals_;  ///< for sides 1, 2, 4 ...
};

}  // namespace terrane::internal
