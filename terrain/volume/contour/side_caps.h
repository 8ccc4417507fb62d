// SPDX-License-Identifier: MIT
#pragma once

#include "contour/edge_vertices.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Closes a contour along a side of its tile, as if there were no volumes beyond it: the part of the vertical plane
/// that is void below the heightfield, or solid above it.
///
/// The plane is divided as the columns on both sides divide it (column_sweep.h, with two lines in place of three), so
/// that the boundary of a cap consists of the contour's edges in the plane and of whole edges of the heightfield. Where
/// the contour has a vertex on an edge of the heightfield, a triangle without area joins the edge's two parts and the
/// whole edge, which is the neighbour's.
class SideCaps {
public:
    SideCaps(const TileLines& lines, const TileFields& fields, EdgeVertices& vertices,
             VolumeContour& contour_out)
        : lines_(lines), fields_(fields), vertices_(vertices), contour_(contour_out) {}

    /// @param side 0 to 3: west, east, south, north
    void close(std::size_t side);

private:
    template <Field field>
    void close_strip();
    void visit(const std::array<LineNode, 3>& corners, Field field);
    void join_edge();
    void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool is_reversed);
    bool is_inside(Field field, const LineNode& node) const;
    /// The lowest, or highest, node of the strip's lines that a field may have inside.
    template <Field field>
    std::int32_t farthest() const;

    const TileLines& lines_;
    const TileFields& fields_;
    EdgeVertices& vertices_;
    VolumeContour& contour_;

    std::size_t side_ = 0;
    bool is_reversed_ = false;  // triangles of voids, seen with the side's lines from left to right
    std::array<int, 2> strip_{};
};

}  // namespace terrane::internal
