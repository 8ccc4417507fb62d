// SPDX-License-Identifier: MIT
#include "contour/tile_contour.h"

#include "base/aabb_tree.h"
#include "contour/edge_vertices.h"

#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Contours the column over one triangle of the heightfield, below it or above it, by marching tetrahedra.
///
/// Method: a plane sweep along the column's three vertical lines. The front is a triangle with one node on each line,
/// initially the triangle of the heightfield. Downwards, the line whose next node is highest advances to it; each
/// advance sweeps one tetrahedron, the front and the new node. So the triangle of the heightfield is a face of a
/// tetrahedron whatever its slope, and a face between two columns is divided alike from both sides, because the order
/// of two lines does not depend on the third. Nodes of one line are a spacing apart. So in each layer, nodes k to k -
/// 1, the lines advance in the same order, by their offsets, and any layer can be visited alone. The sweep upwards is
/// the same with the lowest node first.
///
/// Source: A. Doi, A. Koide. An efficient method of triangulating equi-valued surfaces by using tetrahedral cells.
///         IEICE Transactions E74(1), 1991 (marching tetrahedra).
class ColumnSweep {
public:
    ColumnSweep(const TileLines& lines, const TileFields& fields, EdgeVertices& vertices,
                VolumeContour& contour_out)
        : lines_(lines), fields_(fields), vertices_(vertices), contour_(contour_out) {}

    /// @param column its three lines, counter-clockwise seen from above
    void contour(const std::array<int, 3>& column);
    /// Squared diameter of the largest tetrahedron that the surface passes through so far, m^2.
    double longest_squared() const { return longest_squared_; }

private:
    struct Layers {
        // Each layer has the number of its node that is nearer to the heightfield.
        std::int32_t first = 0, last = 0;
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
    std::array<std::int32_t, 3> surface_{};   // their nodes at the samples
    std::array<std::size_t, 3> ascending_{};  // indices into column_, by height of their nodes k
    std::vector<Layers> layers_;
    std::array<std::vector<std::uint8_t>, 3> inside_;  // [nodes of the layers] 1: in the solid
};

/// Closes a contour along a side of its tile as if there were no volumes beyond: fills the part of the vertical plane
/// that is void below the heightfield, or solid above it.
///
/// The plane is divided in the same way as by the columns on both sides (a ColumnSweep with two lines), so that the
/// boundary of a cap consists of the contour's edges in the plane and of whole edges of the heightfield. Where the
/// contour has a vertex on an edge of the heightfield, a degenerate triangle joins the two parts of the edge to the
/// neighbour's whole edge.
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
    /// The lowest or highest node of the strip's lines at which a field may be negative.
    template <Field field>
    std::int32_t farthest() const;

    const TileLines& lines_;
    const TileFields& fields_;
    EdgeVertices& vertices_;
    VolumeContour& contour_;

    std::size_t side_ = 0;
    bool is_reversed_ = false;  // whether triangles of voids are clockwise: see close()
    std::array<int, 2> strip_{};
};

namespace {

// Even permutations of a tetrahedron's nodes. The surface separates the first node, or the first two, from the others.
constexpr std::array<std::array<std::size_t, 4>, 4> kOneApart = {
    {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}};
constexpr std::array<std::array<std::size_t, 4>, 6> kTwoApart = {
    {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};

}  // namespace

void ColumnSweep::contour(const std::array<int, 3>& column) {
    column_ = column;
    for (std::size_t i = 0; i < 3; ++i)
        surface_[i] = lines_.surface[static_cast<std::size_t>(column[i])];
    ascending_ = {0, 1, 2};
    std::ranges::sort(ascending_, [this](std::size_t a, std::size_t b) {
        return lines_.is_lower(column_[a], column_[b]);
    });
    sweep<Field::to_void>();
    sweep<Field::to_solid>();
}

template <Field field>
void ColumnSweep::sweep() {
    find_layers<field>();
    for (const Layers& layers : layers_) visit<field>(layers);
}

// Finds the layers that contain a node of a run. If one of them is beside a steep triangle of the heightfield, takes
// all layers beside that triangle.
template <Field field>
void ColumnSweep::find_layers() {
    constexpr bool down = field == Field::to_void;
    layers_.clear();
    const auto [lowest, highest] = std::ranges::minmax(surface_);
    const Layers steep = down ? Layers{lowest + 1, highest} : Layers{lowest, highest - 1};
    bool reaches_steep = false;
    for (const int line : column_) {
        for (const FieldRuns::Run& run : fields_.of(field).of_line(line)) {
            Layers layers =
                down ? Layers{run.first, run.last + 1} : Layers{run.first - 1, run.last};
            reaches_steep =
                reaches_steep || (layers.first <= highest + 1 && layers.last >= lowest - 1);
            if (down) {
                layers.last = std::min(layers.last, highest);
            } else {
                layers.first = std::max(layers.first, lowest);
            }
            if (layers.first <= layers.last) layers_.push_back(layers);
        }
    }
    if (reaches_steep && steep.first <= steep.last) layers_.push_back(steep);
    std::ranges::sort(layers_, {}, &Layers::first);
    std::size_t count = 0;
    for (const Layers& layers : layers_) {
        if (count > 0 && layers.first <= layers_[count - 1].last + 1) {
            layers_[count - 1].last = std::max(layers_[count - 1].last, layers.last);
        } else {
            layers_[count++] = layers;
        }
    }
    layers_.resize(count);
}

template <Field field>
void ColumnSweep::visit(const Layers& layers) {
    constexpr bool down = field == Field::to_void;
    const std::int32_t base = down ? layers.first - 1 : layers.first;
    const auto node_count = static_cast<std::size_t>(layers.last - layers.first + 2);
    for (std::size_t i = 0; i < 3; ++i) {
        fields_.copy_inside(field, column_[i], base, node_count, inside_[i]);
    }
    const auto is_inside = [&](std::size_t i, std::int32_t k) {
        return inside_[i][static_cast<std::size_t>(k - base)] != 0;
    };
    for (std::int32_t layer = layers.first; layer <= layers.last; ++layer) {
        ++contour_.layer_count;
        constexpr std::int32_t step = down ? -1 : 1;
        std::array<std::int32_t, 3> front;
        unsigned solid_count = 0, count = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            front[i] = down ? std::min(surface_[i], layer) : std::max(surface_[i], layer);
            solid_count += is_inside(i, front[i]);
            ++count;
            if (front[i] != layer) continue;
            solid_count += is_inside(i, layer + step);
            ++count;
        }
        if (solid_count == 0 || solid_count == count) continue;
        for (std::size_t turn = 0; turn < 3; ++turn) {
            const std::size_t i = ascending_[down ? 2 - turn : turn];
            if (front[i] != layer) continue;
            const std::size_t b = (i + 1) % 3, c = (i + 2) % 3;
            const std::int32_t low = std::min(layer, layer + step),
                               high = std::max(layer, layer + step);
            const unsigned inside =
                unsigned{is_inside(i, low)} | unsigned{is_inside(b, front[b])} << 1 |
                unsigned{is_inside(c, front[c])} << 2 | unsigned{is_inside(i, high)} << 3;
            if (inside != 0 && inside != 15) {
                march({{{column_[i], low},
                        {column_[b], front[b]},
                        {column_[c], front[c]},
                        {column_[i], high}}},
                      inside, field);
            }
            front[i] += step;
        }
    }
}

// Nodes have positive orientation. Triangles are counter-clockwise seen from outside the solid.
void ColumnSweep::march(const std::array<LineNode, 4>& nodes, unsigned inside, Field field) {
    std::array<WorldPos, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = lines_.position(nodes[i].line, nodes[i].k);
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = i + 1; j < 4; ++j) {
            const Eigen::Vector3d edge = corners[j] - corners[i];
            longest_squared_ = std::max(longest_squared_, dot(edge, edge));
        }
    }
    const auto vertex = [&](std::size_t a, std::size_t b) {
        return vertices_.crossing(nodes[a], nodes[b], field);
    };
    for (std::size_t apart = 0; apart < 4; ++apart) {
        const bool only_inside = inside == 1u << apart,
                   only_outside = inside == (15u ^ 1u << apart);
        if (!only_inside && !only_outside) continue;
        const auto& [i, j, k, l] = kOneApart[apart];
        const std::uint32_t a = vertex(i, j), b = vertex(i, k), c = vertex(i, l);
        emit(a, only_inside ? b : c, only_inside ? c : b, field);
        return;
    }
    for (const auto& [i, j, k, l] : kTwoApart) {
        if (inside != (1u << i | 1u << j)) continue;
        const std::uint32_t a = vertex(i, k), b = vertex(i, l), c = vertex(j, l), d = vertex(j, k);
        const auto& p = contour_.positions_world;
        // The shorter diagonal; the quadrilateral is inside one tetrahedron.
        const Eigen::Vector3d a_to_c = p[c] - p[a], b_to_d = p[d] - p[b];
        if (dot(a_to_c, a_to_c) <= dot(b_to_d, b_to_d)) {
            emit(a, b, c, field);
            emit(a, c, d, field);
        } else {
            emit(a, b, d, field);
            emit(b, c, d, field);
        }
        return;
    }
}

void ColumnSweep::emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, Field field) {
    contour_.triangles.push_back({a, b, c});
    contour_.surfaces.push_back(field == Field::to_void ? SolidPart::cavity : SolidPart::overhang);
}

void SideCaps::close(std::size_t side) {
    side_ = side;
    // The view has the lines from left to right, from south to north or from west to east, and z up. In this view the
    // inside of the tile is in front of the western and northern sides, and behind the other two.
    is_reversed_ = side == 1 || side == 2;
    const bool is_column = side < 2;
    const int fixed = side % 2 == 0 ? 0 : kVolumeTileCells;
    for (int i = 0; i < kVolumeTileCells; ++i) {
        strip_ = is_column ? std::array{line_index(fixed, i), line_index(fixed, i + 1)}
                           : std::array{line_index(i, fixed), line_index(i + 1, fixed)};
        close_strip<Field::to_void>();
        close_strip<Field::to_solid>();
        join_edge();
    }
}

bool SideCaps::is_inside(Field field, const LineNode& node) const {
    return fields_.value(field, node) < 0.0;
}

template <Field field>
std::int32_t SideCaps::farthest() const {
    constexpr bool down = field == Field::to_void;
    std::int32_t farthest = lines_.surface[static_cast<std::size_t>(strip_[0])];
    for (const int line : strip_) {
        const auto runs = fields_.of(field).of_line(line);
        const std::int32_t surface = lines_.surface[static_cast<std::size_t>(line)];
        std::int32_t end = surface;
        if (!runs.empty()) end = down ? runs.front().first : runs.back().last;
        farthest = down ? std::min({farthest, surface, end}) : std::max({farthest, surface, end});
    }
    return farthest;
}

template <Field field>
void SideCaps::close_strip() {
    constexpr bool down = field == Field::to_void;
    constexpr std::int32_t step = down ? -1 : 1;
    std::array<std::int32_t, 2> surface{};
    for (std::size_t i = 0; i < 2; ++i) {
        surface[i] = lines_.surface[static_cast<std::size_t>(strip_[i])];
    }
    const std::int32_t end = farthest<field>() + step;
    // Of two nodes of one k, the upper one advances first downwards, the lower one upwards.
    const std::size_t first = lines_.is_lower(strip_[0], strip_[1]) == down ? 1 : 0;
    std::array<std::int32_t, 2> front = surface;
    for (std::int32_t layer = down ? std::max(surface[0], surface[1])
                                   : std::min(surface[0], surface[1]);
         layer != end; layer += step) {
        for (const std::size_t i : {first, 1 - first}) {
            if (front[i] != layer) continue;
            const std::size_t o = 1 - i;
            const LineNode low{strip_[i], std::min(layer, layer + step)};
            const LineNode high{strip_[i], std::max(layer, layer + step)};
            const LineNode other{strip_[o], front[o]};
            // counter-clockwise
            visit(i == 0 ? std::array{high, low, other} : std::array{low, high, other}, field);
            front[i] += step;
        }
    }
}

// Emits the part of a triangle of the plane in which the field is negative.
void SideCaps::visit(const std::array<LineNode, 3>& corners, Field field) {
    std::array<bool, 3> inside{};
    int count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        inside[i] = is_inside(field, corners[i]);
        count += inside[i] ? 1 : 0;
    }
    if (count == 0) return;
    const bool is_reversed = is_reversed_ != (field == Field::to_solid);
    const auto node = [&](std::size_t i) { return vertices_.node(corners[i]); };
    const auto crossing = [&](std::size_t i, std::size_t j) {
        return vertices_.crossing(corners[i], corners[j], field);
    };
    if (count == 3) {
        const std::uint32_t a = node(0), b = node(1), c = node(2);
        emit(a, b, c, is_reversed);
        return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        if (count == 1 && inside[i]) {
            const std::uint32_t a = node(i), b = crossing(i, j), c = crossing(i, k);
            emit(a, b, c, is_reversed);
        } else if (count == 2 && !inside[i]) {
            const std::uint32_t a = node(j), b = node(k), c = crossing(k, i), d = crossing(i, j);
            emit(a, b, c, is_reversed);
            emit(a, c, d, is_reversed);
        }
    }
}

void SideCaps::join_edge() {
    const auto state = [&](std::size_t i) {
        return fields_.states[static_cast<std::size_t>(strip_[i])];
    };
    if (state(0) == state(1)) return;
    const bool is_void = state(0) == SampleState::in_void || state(1) == SampleState::in_void;
    const auto sample = [&](std::size_t i) {
        return LineNode{strip_[i], lines_.surface[static_cast<std::size_t>(strip_[i])]};
    };
    const std::uint32_t a = vertices_.node(sample(0));
    const std::uint32_t b =
        vertices_.crossing(sample(0), sample(1), is_void ? Field::to_void : Field::to_solid);
    const std::uint32_t c = vertices_.node(sample(1));
    emit(a, b, c, is_reversed_);
}

void SideCaps::emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool is_reversed) {
    auto& cap = contour_.caps[side_];
    if (is_reversed) std::swap(b, c);
    cap.push_back({a, b, c});
}

namespace {

/// Clips triangles of the heightfield: keeps the polygon between the natural samples and the crossings.
class GroundCut {
public:
    GroundCut(const TileLines& lines, const TileFields& fields, EdgeVertices& vertices,
              VolumeContour& contour_out)
        : lines_(lines), fields_(fields), vertices_(vertices), contour_(contour_out) {}

    /// @param column lines of the triangle's samples, counter-clockwise seen from above
    /// @param name   as in VolumeContour::replaced
    void cut(const std::array<int, 3>& column, std::uint16_t name) {
        column_ = column;
        std::size_t natural_count = 0;
        for (std::size_t i = 0; i < 3; ++i) natural_count += std::size_t{is_natural(i)};
        if (natural_count == 3) return;
        contour_.replaced.push_back(name);
        if (natural_count == 0) return;
        // The sample that differs from the other two: the only natural one, or the only one that is not natural.
        std::size_t odd_one = 0;
        for (std::size_t i = 1; i < 3; ++i) {
            if (is_natural(i) == (natural_count == 1)) odd_one = i;
        }
        const std::size_t i = odd_one, j = (i + 1) % 3, k = (i + 2) % 3;
        // Braced initialisation, so that every compiler makes the vertices in the same order.
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

/// The lines of a cell's two triangles, the southern one first.
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
