// SPDX-License-Identifier: MIT
#include "lod/keys/open_chunk.h"

namespace terrane::internal {
namespace {

struct Step {
    int column, row;
};
constexpr std::array<Step, 4> kSteps{Step{-1, 0}, Step{1, 0}, Step{0, -1}, Step{0, 1}};

bool is_inside(int column, int row) {
    return column >= 0 && row >= 0 && column < kChunkAreas && row < kChunkAreas;
}

}  // namespace

AreaRef adjacent_area(const OpenChunk& chunk, int area, Side side) {
    const int column = area % kChunkAreas + kSteps[side].column;
    const int row = area / kChunkAreas + kSteps[side].row;
    const auto wrap = [](int i) { return (i + kChunkAreas) % kChunkAreas; };
    return {is_inside(column, row) ? &chunk : chunk.neighbour[side],
            wrap(row) * kChunkAreas + wrap(column)};
}

bool is_world_border(const OpenChunk& chunk, int area, Side side) {
    const int column = area % kChunkAreas + kSteps[side].column;
    const int row = area / kChunkAreas + kSteps[side].row;
    return !is_inside(column, row) && chunk.at_world_border[side];
}

float OpenChunk::key_at(int column, int row) const {
    const auto of_square = [](int sample) { return static_cast<std::size_t>(sample / 2); };
    if (((column | row) & 1) == 0) {
        if (!is_root()) return kNever;
        return coarse_keys[of_square(row) * kCoarseSide + of_square(column)];
    }
    if (column == kChunkCells && at_world_border[east]) return east_keys[of_square(row)];
    if (row == kChunkCells && at_world_border[north]) return north_keys[of_square(column)];
    const OpenChunk* owner = this;
    if (column == kChunkCells || row == kChunkCells) {
        owner = neighbour[column == kChunkCells ? east : north];
        if (owner == nullptr) return kNever;
    }
    const auto [area, kind, square] =
        AreaVertices::address_of(column % kChunkCells, row % kChunkCells);
    return owner->is_open(static_cast<int>(area)) ? owner->keys[area].of[kind][square] : kNever;
}

float OpenChunk::side_rise(Side side, int at, float quantum) const {
    if (!at_world_border[side]) {
        const auto [area, kind, square] =
            side == east ? AreaVertices::address_of(0, at) : AreaVertices::address_of(at, 0);
        const AreaVertices& vertices = neighbour[side]->chunk->vertices->areas[area];
        return vertices.rise_unit * static_cast<float>(vertices.rise[kind][square]);
    }
    const auto height = [&](int i) {
        return chunk
            ->heights[side == east ? sample_index(kChunkCells, i) : sample_index(i, kChunkCells)];
    };
    return 0.5f * quantum *
           (static_cast<float>(height(at) - height(at - 1)) +
            static_cast<float>(height(at) - height(at + 1)));
}

}  // namespace terrane::internal
