// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/local_ground.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Column and row of a vertex of a window.
struct WindowVertex {
    int column = 0;
    int row = 0;
};

/// A range of cells of a window, counted from its south-western cell, bounds inclusive.
struct WindowCells {
    int west = 0, south = 0, east = -1, north = -1;

    WindowCells(const LocalWindow& window, const CellRange& cells)
        : west(static_cast<int>(cells.west - window.cells.west)),
          south(static_cast<int>(cells.south - window.cells.south)),
          east(static_cast<int>(cells.east - window.cells.west)),
          north(static_cast<int>(cells.north - window.cells.south)) {}
};

/// The plane of one of the two triangles of a window's cell.
struct WindowFace {
    Eigen::Vector3d start;  ///< southern end of the cell's diagonal
    double x, y;            ///< slopes
    double square;  ///< 1 + x^2 + y^2: (vertical distance to the plane / perpendicular distance)^2
    bool is_even;   ///< whether the diagonal runs from south-west to north-east

    /// Vertical height of a point above the plane, metres.
    double above(const Eigen::Vector3d& p) const {
        return (p[2] - start[2]) - (x * (p[0] - start[0]) + y * (p[1] - start[1]));
    }
    /// False if the projection of a point onto the plane lies outside the cell by more than rounding.
    ///
    /// @param above above() of the point
    bool may_have_foot(const Eigen::Vector3d& p, double above, double spacing) const {
        const double slack = 1e-9 * spacing;
        const double along = above / square;
        const double east = p[0] - start[0] + x * along + (is_even ? 0.0 : spacing);
        const double north = p[1] - start[1] + y * along;
        return east >= -slack && east <= spacing + slack && north >= -slack &&
               north <= spacing + slack;
    }
};

/// The southern or northern face of a window's cell.
inline WindowFace make_window_face(const LocalGround& local, const LocalWindow& window, int column,
                                   int row, bool is_south) {
    const bool is_even = window.is_cut_to_north_east(column, row);
    const WindowSlopes slopes = window.slopes(column, row, is_south);
    const double x = slopes.x * local.inverse_spacing();
    const double y = slopes.y * local.inverse_spacing();
    return {local.vertex(window, is_even ? column : column + 1, row), x, y, 1.0 + x * x + y * y,
            is_even};
}

/// Outcodes of a window's vertices: each bit marks a vertex beyond one plane. An edge or triangle whose vertices share
/// a bit is beyond that plane.
struct WindowCodes {
    std::array<std::uint8_t, static_cast<std::size_t>(LocalWindow::kStride) * LocalWindow::kStride>
        bits;

    std::uint8_t& at(int column, int row) { return bits[LocalWindow::index(column, row)]; }
    std::uint8_t at(int column, int row) const { return bits[LocalWindow::index(column, row)]; }
};

/// Visits the convex edges among the southern side, the western side and the diagonal of each cell of a rectangle.
/// Skips edges whose two ends share an outcode bit, and sides on the border of the ground. The window must hold one
/// more cell on each side.
///
/// @param visitor void(from, to, left, right); left and right are the third corners of the edge's two triangles
template <class Visitor>
void visit_convex_edges(const LocalWindow& window, const WindowCells& cells,
                        const WindowCodes& codes, Visitor&& visitor) {
    const auto are_ground = [&](int column, int row, int other_column, int other_row) {
        return window.is_full ||
               (window.is_ground(column, row) && window.is_ground(other_column, other_row));
    };
    for (int row = cells.south; row <= cells.north; ++row) {
        for (int column = cells.west; column <= cells.east; ++column) {
            const unsigned here = codes.at(column, row);
            const bool is_even = window.is_cut_to_north_east(column, row);
            // Third corners mirror each other in plan: about the odd end of a side, about the middle of a diagonal.
            if ((here & codes.at(column + 1, row)) == 0) {
                const int odd = is_even ? column + 1 : column;
                const double across = window.at(odd, row + 1) + window.at(odd, row - 1);
                if (across < 2.0 * window.at(odd, row) &&
                    are_ground(column, row, column, row - 1)) {
                    visitor(WindowVertex{column, row}, WindowVertex{column + 1, row},
                            WindowVertex{odd, row + 1}, WindowVertex{odd, row - 1});
                }
            }
            if ((here & codes.at(column, row + 1)) == 0) {
                const int odd = is_even ? row + 1 : row;
                const double across = window.at(column + 1, odd) + window.at(column - 1, odd);
                if (across < 2.0 * window.at(column, odd) &&
                    are_ground(column, row, column - 1, row)) {
                    visitor(WindowVertex{column, row}, WindowVertex{column, row + 1},
                            WindowVertex{column + 1, odd}, WindowVertex{column - 1, odd});
                }
            }
            const int from = is_even ? column : column + 1;
            const int to = is_even ? column + 1 : column;
            if ((codes.at(from, row) & codes.at(to, row + 1)) != 0) continue;
            const double across = window.at(to, row) + window.at(from, row + 1);
            if (across < window.at(from, row) + window.at(to, row + 1) &&
                are_ground(column, row, column, row)) {
                visitor(WindowVertex{from, row}, WindowVertex{to, row + 1}, WindowVertex{to, row},
                        WindowVertex{from, row + 1});
            }
        }
    }
}

/// Whether no neighbour of a vertex is higher along the direction n by more than `slack` metres. False at the border of
/// the ground, where only faces have contacts.
///
/// @param spacing of the window's cells, metres
inline bool is_top(const LocalWindow& window, const WindowVertex& at, double spacing,
                   const Eigen::Vector3d& n, double slack) {
    const int column = at.column;
    const int row = at.row;
    if (!window.is_full &&
        !(window.is_ground(column, row) && window.is_ground(column - 1, row) &&
          window.is_ground(column, row - 1) && window.is_ground(column - 1, row - 1))) {
        return false;
    }
    const double z = window.at(column, row);
    const double east = spacing * n[0];
    const double north = spacing * n[1];
    const auto rises = [&](int x, int y) {
        const double level = static_cast<double>(x) * east + static_cast<double>(y) * north;
        return level + n[2] * (window.at(column + x, row + y) - z) > slack;
    };
    if (rises(1, 0) || rises(-1, 0) || rises(0, 1) || rises(0, -1)) return false;
    const bool has_diagonals = window.is_cut_to_north_east(column, row);
    return !has_diagonals || !(rises(1, 1) || rises(-1, 1) || rises(1, -1) || rises(-1, -1));
}

}  // namespace terrane::internal
