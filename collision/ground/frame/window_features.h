// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Indices of a vertex of a window.
struct WindowVertex {
    int column = 0;
    int row = 0;
};

/// Cells of a window, by what is counted from its south-western one: both ends belong to them.
struct WindowCells {
    int west = 0, south = 0, east = -1, north = -1;

    WindowCells(const GroundWindow& window, const CellRange& cells)
        : west(static_cast<int>(cells.west - window.cells.west)),
          south(static_cast<int>(cells.south - window.cells.south)),
          east(static_cast<int>(cells.east - window.cells.west)),
          north(static_cast<int>(cells.north - window.cells.south)) {}
};

/// The plane of one of the two triangles of a window's cell, and what lies square to it.
struct WindowFace {
    Eigen::Vector3d start;  ///< where the cell's cut starts in the south
    double x, y;            ///< slopes
    double square;          ///< of a length along the vertical over the same square to the plane
    bool is_even;           ///< whether the cut runs to the north-east

    /// How high a point is over the plane, along the vertical.
    double above(const Eigen::Vector3d& p) const {
        return (p[2] - start[2]) - (x * (p[0] - start[0]) + y * (p[1] - start[1]));
    }
    /// False where the foot of the perpendicular from a point that is so high above lies outside of the cell by
    /// more than a hair.
    bool may_have_foot(const Eigen::Vector3d& p, double above, double spacing) const {
        const double hair = 1e-9 * spacing;
        const double along = above / square;
        const double east = p[0] - start[0] + x * along + (is_even ? 0.0 : spacing);
        const double north = p[1] - start[1] + y * along;
        return east >= -hair && east <= spacing + hair && north >= -hair && north <= spacing + hair;
    }
};

/// The face of a window's cell on its southern or northern side.
inline WindowFace make_window_face(const LocalGround& local, const GroundWindow& window, int column,
                                   int row, bool is_south) {
    const bool is_even = window.is_cut_to_north_east(column, row);
    const WindowSlopes slopes = window.slopes(column, row, is_south);
    const double x = slopes.x * local.inverse_spacing();
    const double y = slopes.y * local.inverse_spacing();
    return {local.vertex(window, is_even ? column : column + 1, row), x, y, 1.0 + x * x + y * y,
            is_even};
}

/// Bits of a window's vertices: each says that a vertex lies on the far side of something. What joins two
/// vertices that share one lies there too.
struct WindowCodes {
    std::array<std::uint8_t,
               static_cast<std::size_t>(GroundWindow::kStride) * GroundWindow::kStride>
        bits;

    std::uint8_t& at(int column, int row) { return bits[GroundWindow::index(column, row)]; }
    std::uint8_t at(int column, int row) const { return bits[GroundWindow::index(column, row)]; }
};

/// Visits the southern and western sides and the diagonals of a rectangle of cells where the ground is convex
/// and the two ends share no bit; sides where the ground ends are none. One more cell on each side lies in the
/// window.
///
/// @param take void(from, to, left, right), with the third corners of the edge's two triangles
template <class Take>
void visit_convex_edges(const GroundWindow& window, const WindowCells& cells,
                        const WindowCodes& codes, Take&& take) {
    const auto are_ground = [&](int column, int row, int other_column, int other_row) {
        return window.is_full ||
               (window.is_ground(column, row) && window.is_ground(other_column, other_row));
    };
    for (int row = cells.south; row <= cells.north; ++row) {
        for (int column = cells.west; column <= cells.east; ++column) {
            const unsigned here = codes.at(column, row);
            const bool is_even = window.is_cut_to_north_east(column, row);
            // A side lies between the third corners at its odd end, a diagonal in its middle.
            if ((here & codes.at(column + 1, row)) == 0) {
                const int odd = is_even ? column + 1 : column;
                const double across = window.at(odd, row + 1) + window.at(odd, row - 1);
                if (across < 2.0 * window.at(odd, row) &&
                    are_ground(column, row, column, row - 1)) {
                    take(WindowVertex{column, row}, WindowVertex{column + 1, row},
                         WindowVertex{odd, row + 1}, WindowVertex{odd, row - 1});
                }
            }
            if ((here & codes.at(column, row + 1)) == 0) {
                const int odd = is_even ? row + 1 : row;
                const double across = window.at(column + 1, odd) + window.at(column - 1, odd);
                if (across < 2.0 * window.at(column, odd) &&
                    are_ground(column, row, column - 1, row)) {
                    take(WindowVertex{column, row}, WindowVertex{column, row + 1},
                         WindowVertex{column + 1, odd}, WindowVertex{column - 1, odd});
                }
            }
            const int from = is_even ? column : column + 1;
            const int to = is_even ? column + 1 : column;
            if ((codes.at(from, row) & codes.at(to, row + 1)) != 0) continue;
            const double across = window.at(to, row) + window.at(from, row + 1);
            if (across < window.at(from, row) + window.at(to, row + 1) &&
                are_ground(column, row, column, row)) {
                take(WindowVertex{from, row}, WindowVertex{to, row + 1}, WindowVertex{to, row},
                     WindowVertex{from, row + 1});
            }
        }
    }
}

/// Whether no neighbour of a vertex is higher along a direction by more than a slack. Where the ground ends
/// only faces count: no.
///
/// @param spacing of the window's cells, metres
inline bool is_top(const GroundWindow& window, const WindowVertex& at, double spacing,
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
