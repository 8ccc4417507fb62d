// SPDX-License-Identifier: MIT
#pragma once

#include "ground_window.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Indices of a vertex of a window.
struct WindowVertex {
    int column = 0;
    int row = 0;
};

/// Bits of a window's vertices: each says that a vertex lies on the far side of something. What joins two
/// vertices that share one lies there too.
struct WindowCodes {
    std::array<std::uint8_t,
               static_cast<std::size_t>(GroundWindow::kStride) * GroundWindow::kStride>
        bits;

    std::uint8_t& at(int column, int row) { return bits[GroundWindow::index(column, row)]; }
    std::uint8_t at(int column, int row) const { return bits[GroundWindow::index(column, row)]; }
};

/// Visits the edges between vertices of a rectangle that share no bit, where the ground is convex; those where
/// it ends are none. One more vertex on each side lies in the window.
///
/// @param take void(from, to, left, right), with the third corners of the edge's two triangles
template <class Take>
void visit_convex_edges(const GroundWindow& window, const WindowVertex& first,
                        const WindowVertex& last, const WindowCodes& codes, Take&& take) {
    const auto are_ground = [&](int column, int row, int other_column, int other_row) {
        return window.is_full ||
               (window.is_ground(column, row) && window.is_ground(other_column, other_row));
    };
    for (int row = first.row; row <= last.row; ++row) {
        for (int column = first.column; column <= last.column; ++column) {
            const unsigned here = codes.at(column, row);
            const bool is_even = window.is_cut_to_north_east(column, row);
            // A side lies between the third corners at its odd end, a diagonal in its middle.
            if (column < last.column && (here & codes.at(column + 1, row)) == 0) {
                const int odd = is_even ? column + 1 : column;
                const double across = window.at(odd, row + 1) + window.at(odd, row - 1);
                if (across < 2.0 * window.at(odd, row) &&
                    are_ground(column, row, column, row - 1)) {
                    take(WindowVertex{column, row}, WindowVertex{column + 1, row},
                         WindowVertex{odd, row + 1}, WindowVertex{odd, row - 1});
                }
            }
            if (row == last.row) continue;
            if ((here & codes.at(column, row + 1)) == 0) {
                const int odd = is_even ? row + 1 : row;
                const double across = window.at(column + 1, odd) + window.at(column - 1, odd);
                if (across < 2.0 * window.at(column, odd) &&
                    are_ground(column, row, column - 1, row)) {
                    take(WindowVertex{column, row}, WindowVertex{column, row + 1},
                         WindowVertex{column + 1, odd}, WindowVertex{column - 1, odd});
                }
            }
            if (column == last.column) continue;
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
