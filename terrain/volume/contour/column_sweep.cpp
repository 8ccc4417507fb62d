// SPDX-License-Identifier: MIT
#include "contour/column_sweep.h"

#include "base/boxes.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Even permutations of a tetrahedron's nodes. The first node, or the first two, are on one side of the surface.
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

// Layers with a node of a run, and all beside a steep triangle of the heightfield if any of them has one.
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

// Nodes: positive volume. Triangles: counter-clockwise from outside the solid.
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
        // The shorter diagonal; no other tetrahedron sees it.
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

}  // namespace terrane::internal
