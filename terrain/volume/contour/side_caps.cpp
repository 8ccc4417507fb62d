// SPDX-License-Identifier: MIT
#include "contour/side_caps.h"

#include <algorithm>

namespace terrane::internal {

void SideCaps::close(std::size_t side) {
    side_ = side;
    // Lines from south to north or from west to east; up is up. Seen so, the inside of the tile is behind the western
    // and northern side.
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
    // Downwards the upper of two nodes of one k advances first, upwards the lower one.
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

// The part of a triangle of the plane that is inside.
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

}  // namespace terrane::internal
