// SPDX-License-Identifier: MIT
#include "lod/keys/parent_keys.h"

namespace terrane::internal {
namespace {

using Line = std::array<float, AreaVertices::kSquares>;
constexpr Line filled(float key) {
    Line line{};
    for (float& value : line) value = key;
    return line;
}
// Keys of absent parents, which bar their children, and of parents beyond the world's border, which do not.
constexpr Line kAbsent = filled(OpenChunk::kNever);
constexpr Line kNothing = filled(0.0f);

const float* adjacent_keys(const OpenChunk& chunk, int area, Side side, AreaVertices::Kind kind) {
    const AreaRef adjacent = adjacent_area(chunk, area, side);
    return adjacent.is_open() ? adjacent.chunk->keys_of(adjacent.area)[kind].data()
                              : kAbsent.data();
}

}  // namespace

const float* adjacent_centres(const OpenChunk& chunk, int area, Side side) {
    if (is_world_border(chunk, area, side)) return kNothing.data();
    return adjacent_keys(chunk, area, side, AreaVertices::centre);
}

CentreParents::CentreParents(const OpenChunk& chunk, int area) {
    sides_.north = sides_.east = kAbsent.data();
    if (chunk.is_root()) {
        gather(chunk, area);
    } else {
        find(chunk, area);
    }
}

void CentreParents::gather(const OpenChunk& root, int area) {
    const auto west = static_cast<std::size_t>(area % kChunkAreas * kAreaSquares);
    const auto south = static_cast<std::size_t>(area / kChunkAreas * kAreaSquares);
    const auto at = [&](std::size_t column, std::size_t row) {
        return root.coarse_keys[(south + row) * OpenChunk::kCoarseSide + west + column];
    };
    constexpr std::size_t kHalf = kAreaSquares / 2;
    for (std::size_t j = 0; j <= kHalf; ++j) {
        for (std::size_t i = 0; i <= kHalf; ++i) {
            const std::size_t square = j * kAreaSquares + i;
            along_x_[square] = i < kHalf ? at(2 * i + 1, 2 * j) : OpenChunk::kNever;
            along_y_[square] = j < kHalf ? at(2 * i, 2 * j + 1) : OpenChunk::kNever;
        }
        for (std::size_t i = kHalf + 1; i < kAreaSquares; ++i) {
            along_x_[j * kAreaSquares + i] = along_y_[j * kAreaSquares + i] = OpenChunk::kNever;
        }
    }
    sides_.along_x = along_x_.data();
    sides_.along_y = along_y_.data();
}

void CentreParents::find(const OpenChunk& chunk, int area) {
    const OpenChunk& parent = *chunk.parent;
    const ChunkKey& key = chunk.chunk->key;
    const int shift_x = (key.x & 1) != 0 ? kChunkAreas / 2 : 0;
    const int shift_y = (key.y & 1) != 0 ? kChunkAreas / 2 : 0;
    const int column = area % kChunkAreas, row = area / kChunkAreas;
    const int above = (shift_y + row / 2) * kChunkAreas + shift_x + column / 2;
    sides_.column = column % 2 * (kAreaSquares / 2);
    sides_.row = row % 2 * (kAreaSquares / 2);
    sides_.along_x = sides_.along_y = kAbsent.data();
    if (parent.is_open(above)) {
        sides_.along_x = parent.keys_of(above)[AreaVertices::along_x].data();
        sides_.along_y = parent.keys_of(above)[AreaVertices::along_y].data();
    }
    if (sides_.row != 0) {
        sides_.north =
            is_world_border(parent, above, north)
                ? &parent.north_keys[static_cast<std::size_t>(above % kChunkAreas * kAreaSquares)]
                : adjacent_keys(parent, above, north, AreaVertices::along_x);
    }
    if (sides_.column != 0 && is_world_border(parent, above, east)) {
        const auto first = static_cast<std::size_t>(above / kChunkAreas * kAreaSquares);
        along_y_ = kAbsent;
        for (std::size_t i = 0; i < kAreaSquares; ++i) {
            along_y_[i * kAreaSquares] = parent.east_keys[first + i];
        }
        sides_.east = along_y_.data();
    } else if (sides_.column != 0) {
        sides_.east = adjacent_keys(parent, above, east, AreaVertices::along_y);
    }
}

}  // namespace terrane::internal
