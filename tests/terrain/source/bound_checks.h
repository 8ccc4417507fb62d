// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/terrain/height_source.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Checks of what any HeightSource promises. Each adds failures to the running test.
namespace terrane::test {

/// A corner of a triangle, lattice indices.
struct Corner {
    std::int64_t x = 0, y = 0;
};
using Triangle = std::array<Corner, 3>;

/// Largest distance of the true surface from a triangle over its corners, at random points.
inline double measure(const HeightSource& source, const Triangle& triangle, int points,
                      Random& random) {
    const Lattice& lattice = source.lattice();
    std::array<double, 3> xs{}, ys{}, heights{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
        xs[corner] = lattice.x(triangle[corner].x);
        ys[corner] = lattice.y(triangle[corner].y);
        heights[corner] = source.height(xs[corner], ys[corner]);
    }
    double largest = 0.0;
    for (int point = 0; point < points; ++point) {
        double a = random.between(0.0, 1.0), b = random.between(0.0, 1.0);
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        const double c = 1.0 - a - b;
        const double x = a * xs[0] + b * xs[1] + c * xs[2];
        const double y = a * ys[0] + b * ys[1] + c * ys[2];
        const double plane = a * heights[0] + b * heights[1] + c * heights[2];
        largest = std::max(largest, std::abs(source.height(x, y) - plane));
    }
    return largest;
}

inline bool odd(std::int64_t value) { return (value & 1) != 0; }

/// The two triangles of a square of lattice points, cut between its corners of even index sum.
inline std::array<Triangle, 2> cut_square(std::int64_t west, std::int64_t south,
                                          std::int64_t side) {
    const Corner sw{west, south}, se{west + side, south};
    const Corner nw{west, south + side}, ne{west + side, south + side};
    if (odd(west / side) == odd(south / side)) return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

/// The diamond of a vertex of spacing s, as height_source.h defines it.
inline std::array<Triangle, 2> diamond(std::int64_t x, std::int64_t y, std::int64_t s) {
    if (odd(x / s) && odd(y / s)) return cut_square(x - s, y - s, 2 * s);
    const Corner west{x - s, y}, east{x + s, y}, south{x, y - s}, north{x, y + s};
    if (odd(x / s)) return {{{west, east, north}, {west, south, east}}};
    return {{{south, north, west}, {south, east, north}}};
}

inline std::size_t at(const SampleGrid& grid, int column, int row) {
    return static_cast<std::size_t>(row * grid.columns + column);
}

inline std::vector<float> vertex_bounds(const HeightSource& source, const SampleGrid& grid) {
    std::vector<float> bounds(grid.size(), -1.0f);
    EXPECT_TRUE(source.vertex_bounds(grid, bounds).has_value());
    return bounds;
}

inline std::vector<float> cell_bounds(const HeightSource& source, const SampleGrid& grid) {
    std::vector<float> bounds(static_cast<std::size_t>((grid.columns - 1) * (grid.rows - 1)),
                              -1.0f);
    EXPECT_TRUE(source.cell_bounds(grid, bounds).has_value());
    return bounds;
}

/// The bounds of the vertices and cells of a grid are above what random points of their triangles
/// measure, and not all far above.
///
/// @param points  in each triangle
/// @return the largest measured deviation over its bound
inline double check_bounds(const HeightSource& source, const SampleGrid& grid, int points,
                           Random& random) {
    double closest = 0.0;
    const auto check = [&](const std::array<Triangle, 2>& triangles, float bound, const char* what,
                           int column, int row) {
        const double measured = std::max(measure(source, triangles[0], points, random),
                                         measure(source, triangles[1], points, random));
        EXPECT_LE(measured, static_cast<double>(bound))
            << what << " " << column << ", " << row << " of step " << grid.step;
        if (bound > 0.0f) closest = std::max(closest, measured / static_cast<double>(bound));
    };
    const std::vector<float> vertices = vertex_bounds(source, grid);
    const std::vector<float> cells = cell_bounds(source, grid);
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const std::int64_t x = grid.corner.x + grid.step * column;
            const std::int64_t y = grid.corner.y + grid.step * row;
            const float bound = vertices[at(grid, column, row)];
            if (((row | column) & 1) != 0) {
                check(diamond(x, y, grid.step), bound, "vertex", column, row);
            } else {
                EXPECT_EQ(bound, 0.0f) << "no vertex of this spacing";
            }
            if (column + 1 < grid.columns && row + 1 < grid.rows) {
                const std::size_t cell =
                    static_cast<std::size_t>(row * (grid.columns - 1) + column);
                check(cut_square(x, y, grid.step), cells[cell], "cell", column, row);
            }
        }
    }
    return closest;
}

/// Bounds of a grid's centres are at least those of the midpoints around, and bounds of midpoints at
/// least those of the cells around, exactly.
inline void check_nesting_of_spacing(const HeightSource& source, const SampleGrid& grid) {
    const std::vector<float> vertices = vertex_bounds(source, grid);
    const std::vector<float> cells = cell_bounds(source, grid);
    const auto cell = [&](int column, int row) {
        return cells[static_cast<std::size_t>(row * (grid.columns - 1) + column)];
    };
    for (int row = 1; row + 1 < grid.rows; ++row) {
        for (int column = 1; column + 1 < grid.columns; ++column) {
            const float bound = vertices[at(grid, column, row)];
            for (const int side : {-1, 1}) {
                if ((row & column & 1) != 0) {
                    EXPECT_GE(bound, vertices[at(grid, column + side, row)]);
                    EXPECT_GE(bound, vertices[at(grid, column, row + side)]);
                } else if (((row | column) & 1) != 0) {
                    EXPECT_GE(bound, cell(column + (side - 1) / 2, row));
                    EXPECT_GE(bound, cell(column + (side - 1) / 2, row - 1));
                }
            }
        }
    }
}

/// Both kinds of bounds in one go have the bits of each.
inline void check_mesh_bounds(const HeightSource& source, const SampleGrid& grid) {
    std::vector<float> vertices(grid.size(), -1.0f);
    std::vector<float> cells(static_cast<std::size_t>((grid.columns - 1) * (grid.rows - 1)), -1.0f);
    ASSERT_TRUE(source.mesh_bounds(grid, vertices, cells).has_value());
    EXPECT_EQ(vertices, vertex_bounds(source, grid));
    EXPECT_EQ(cells, cell_bounds(source, grid));
}

/// Bounds of a grid's vertices are at least those of their children, exactly. Requires step > 1.
inline void check_nesting(const HeightSource& source, const SampleGrid& grid) {
    SampleGrid fine = grid;
    fine.step = grid.step / 2;
    fine.corner = {grid.corner.x - grid.step, grid.corner.y - grid.step};
    fine.columns = 2 * grid.columns + 3;
    fine.rows = 2 * grid.rows + 3;
    const std::vector<float> coarse_bounds = vertex_bounds(source, grid);
    const std::vector<float> fine_bounds = vertex_bounds(source, fine);
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            if (((row | column) & 1) == 0) continue;
            const float bound = coarse_bounds[at(grid, column, row)];
            if ((row & column & 1) != 0) {  // a centre: the midpoints around it that the grid has
                EXPECT_GE(bound, coarse_bounds[at(grid, column - 1, row)]);
                EXPECT_GE(bound, coarse_bounds[at(grid, column, row - 1)]);
                if (column + 1 < grid.columns) {
                    EXPECT_GE(bound, coarse_bounds[at(grid, column + 1, row)]);
                }
                if (row + 1 < grid.rows) {
                    EXPECT_GE(bound, coarse_bounds[at(grid, column, row + 1)]);
                }
            } else {  // a midpoint: the four centres around it
                for (const int dx : {-1, 1}) {
                    for (const int dy : {-1, 1}) {
                        EXPECT_GE(bound,
                                  fine_bounds[at(fine, 2 * column + 2 + dx, 2 * row + 2 + dy)]);
                    }
                }
            }
        }
    }
}

/// Samples, vertex bounds and cell bounds of a grid have the same bits where a larger grid asks.
inline void check_same_bits(const HeightSource& source, const SampleGrid& grid) {
    SampleGrid large = grid;
    const int before_x = 6, before_y = 4;  // even, so that the corner stays legal
    large.corner = {grid.corner.x - before_x * grid.step, grid.corner.y - before_y * grid.step};
    large.columns += before_x + 3;
    large.rows += before_y + 7;
    std::vector<double> heights(grid.size()), large_heights(large.size());
    ASSERT_TRUE(source.sample(grid, heights).has_value());
    ASSERT_TRUE(source.sample(large, large_heights).has_value());
    const std::vector<float> vertices = vertex_bounds(source, grid);
    const std::vector<float> large_vertices = vertex_bounds(source, large);
    const std::vector<float> cells = cell_bounds(source, grid);
    const std::vector<float> large_cells = cell_bounds(source, large);
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const std::size_t here = at(grid, column, row);
            const std::size_t there = at(large, column + before_x, row + before_y);
            EXPECT_EQ(heights[here], large_heights[there]);
            EXPECT_EQ(vertices[here], large_vertices[there]);
            if (column + 1 < grid.columns && row + 1 < grid.rows) {
                EXPECT_EQ(cells[static_cast<std::size_t>(row * (grid.columns - 1) + column)],
                          large_cells[static_cast<std::size_t>(
                              (row + before_y) * (large.columns - 1) + column + before_x)]);
            }
        }
    }
}

/// A grid with its corner at a multiple of twice the step within +-reach steps of the origin.
inline SampleGrid random_grid(std::int64_t step, std::int64_t reach, int columns, int rows,
                              Random& random) {
    const auto corner = [&] {
        return 2 * step *
               static_cast<std::int64_t>(
                   std::floor(random.between(-0.5, 0.5) * static_cast<double>(reach)));
    };
    const std::int64_t x = corner();
    return {{x, corner()}, step, columns, rows};
}

}  // namespace terrane::test
