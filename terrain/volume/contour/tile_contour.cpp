// SPDX-License-Identifier: MIT
#include "contour/tile_contour.h"

#include "contour/column_sweep.h"
#include "contour/side_caps.h"

#include <terrane/terrain/lattice.h>

#include <cmath>

namespace terrane::internal {
namespace {

/// Clips triangles of the heightfield: keeps the polygon between the natural samples and the crossings.
class GroundCut {
public:
    GroundCut(const TileLines& lines, const TileFields& fields, EdgeVertices& vertices,
              VolumeContour& contour_out)
        : lines_(lines), fields_(fields), vertices_(vertices), contour_(contour_out) {}

    /// @param column lines of the triangle's samples, counter-clockwise from above
    /// @param name   as in VolumeContour::replaced
    void cut(const std::array<int, 3>& column, std::uint16_t name) {
        column_ = column;
        std::size_t natural_count = 0;
        for (std::size_t i = 0; i < 3; ++i) natural_count += std::size_t{is_natural(i)};
        if (natural_count == 3) return;
        contour_.replaced.push_back(name);
        if (natural_count == 0) return;
        // The natural sample among others, or the other one among natural ones.
        std::size_t odd_one = 0;
        for (std::size_t i = 1; i < 3; ++i) {
            if (is_natural(i) == (natural_count == 1)) odd_one = i;
        }
        const std::size_t i = odd_one, j = (i + 1) % 3, k = (i + 2) % 3;
        // Braces, so that every compiler makes the vertices in the same order.
        if (natural_count == 2) {
            emit_quad(Quad{crossing(i, j), sample(j), sample(k), crossing(i, k)});
        } else if (state(j) == state(k)) {
            emit(Corners{sample(i), crossing(i, j), crossing(i, k)});
        } else {
            // Cavity and overhang meet at the crossing of the opposite edge.
            emit_quad(Quad{sample(i), crossing(i, j), crossing(j, k), crossing(i, k)});
        }
    }

private:
    using Corners = std::array<std::uint32_t, 3>;
    using Quad = std::array<std::uint32_t, 4>;

    SampleState state(std::size_t i) const {
        return fields_.states[static_cast<std::size_t>(column_[i])];
    }
    bool is_natural(std::size_t i) const { return state(i) == SampleState::natural; }
    std::uint32_t sample(std::size_t i) { return vertices_.sample(column_[i]); }
    std::uint32_t crossing(std::size_t i, std::size_t j) {
        const auto node = [this](int line) {
            return LineNode{line, lines_.surface[static_cast<std::size_t>(line)]};
        };
        const bool is_void = state(i) == SampleState::in_void || state(j) == SampleState::in_void;
        return vertices_.crossing(node(column_[i]), node(column_[j]),
                                  is_void ? Field::to_void : Field::to_solid);
    }
    void emit(const Corners& corners) {
        contour_.triangles.push_back(corners);
        contour_.surfaces.push_back(SolidPart::ground);
    }
    void emit_quad(const Quad& quad) {
        emit({quad[0], quad[1], quad[2]});
        emit({quad[0], quad[2], quad[3]});
    }

    const TileLines& lines_;
    const TileFields& fields_;
    EdgeVertices& vertices_;
    VolumeContour& contour_;
    std::array<int, 3> column_{};
};

/// Lines of a cell's two triangles, the southern one first.
std::array<std::array<int, 3>, 2> triangles_of(const TileLines& lines, int column, int row) {
    const int sw = line_index(column, row), se = sw + 1, nw = line_index(column, row + 1),
              ne = nw + 1;
    if (cut_to_north_east(lines.west + column, lines.south + row))
        return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

}  // namespace

VolumeContour contour_tile(const TileLevelSet& level_set, const TileLines& lines,
                           const VolumeTileKey& key, const std::array<bool, 4>& closes) {
    VolumeContour contour;
    contour.key = key;
    const TileFields fields(level_set, lines);
    EdgeVertices vertices(lines, fields, contour);
    ColumnSweep sweep(lines, fields, vertices, contour);
    GroundCut ground(lines, fields, vertices, contour);
    for (int row = 0; row < kVolumeTileCells; ++row) {
        for (int column = 0; column < kVolumeTileCells; ++column) {
            const auto triangles = triangles_of(lines, column, row);
            for (std::size_t i = 0; i < 2; ++i) {
                sweep.contour(triangles[i]);
                ground.cut(triangles[i], static_cast<std::uint16_t>(
                                             2 * (row * kVolumeTileCells + column) + int(i)));
            }
        }
    }
    contour.error_m = std::sqrt(sweep.longest_squared()) * (1.0 + 1e-12);
    SideCaps caps(lines, fields, vertices, contour);
    for (std::size_t side = 0; side < 4; ++side) {
        if (closes[side]) caps.close(side);
    }
    return contour;
}

}  // namespace terrane::internal
