// SPDX-License-Identifier: MIT
#pragma once

#include "contour/edge_vertices.h"

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Contours the column over one triangle of the heightfield, below it or above it, by marching tetrahedra.
///
/// Method: a plane sweep along the column's three vertical lines. Its front is a triangle of one node of each line, at
/// first the triangle of the heightfield. Downwards, the line whose next node is highest advances to it, and each
/// advance sweeps one tetrahedron: the front and the new node. So the triangle of the heightfield is a face of the
/// tetrahedra whatever its slope, and a face between two columns is divided alike from both sides, because the order of
/// two lines does not depend on the third. Nodes of one line are a spacing apart, so that in each layer, nodes k to
/// k - 1, lines advance in the same order, that of their offsets: any layer can be visited alone. Upwards, the same in
/// ascending order.
///
/// Sources: A. Doi, A. Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells.
///          IEICE Transactions E74(1), 1991.
class ColumnSweep {
public:
    ColumnSweep(const TileLines& lines, const TileFields& fields, EdgeVertices& vertices,
                VolumeContour& contour_out)
        : lines_(lines), fields_(fields), vertices_(vertices), contour_(contour_out) {}

    /// @param column lines, counter-clockwise from above
    void contour(const std::array<int, 3>& column);
    /// Squared diameter of the largest tetrahedron that the surface has passed through, m^2.
    double longest_squared() const { return longest_squared_; }

private:
    struct Layers {
        std::int32_t
            first = 0,
            last = 0;  // of a layer: its upper node below the heightfield, else its lower node
    };
    static constexpr std::uint32_t kDown = 0, kUp = 1;

    template <Field field>
    void sweep();
    template <Field field>
    void find_layers();
    template <Field field>
    void visit(const Layers& layers);
    void march(const std::array<LineNode, 4>& nodes, unsigned inside, Field field);
    void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, Field field);

    const TileLines& lines_;
    const TileFields& fields_;
    EdgeVertices& vertices_;
    VolumeContour& contour_;
    double longest_squared_ = 0.0;

    std::array<int, 3> column_{};             // lines
    std::array<std::int32_t, 3> surface_{};   // their samples
    std::array<std::size_t, 3> ascending_{};  // indices into column_: order of nodes of one k
    std::vector<Layers> layers_;
    std::array<std::vector<std::uint8_t>, 3>
        inside_;  // of nodes of the visited layers: in the solid
};

}  // namespace terrane::internal
