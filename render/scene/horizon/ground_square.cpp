// SPDX-License-Identifier: MIT
#include "horizon/ground_square.h"

#include <algorithm>
#include <bit>

namespace terrane::internal {
namespace {

// Largest bound of the areas that a square touches.
float largest_bound(const Chunk& chunk, const GroundSquare& square) {
    const int side = 1 << square.log2_side;
    float bound = 0.0f;
    for (int row = square.row / kAreaCells; row * kAreaCells < square.row + side; ++row) {
        for (int column = square.column / kAreaCells; column * kAreaCells < square.column + side;
             ++column) {
            const auto area = static_cast<std::size_t>(row * kChunkAreas + column);
            bound = std::max(bound, chunk.areas[area].max_cell_bound);
        }
    }
    return bound;
}

}  // namespace

std::array<GroundSquare, 4> GroundSquare::quarters(const ResidentSet& resident) const {
    const int half_log2 = log2_side - 1;
    const int half = 1 << half_log2;
    std::array<GroundSquare, 4> quarters;
    const auto& children = resident.links(static_cast<std::size_t>(index)).child;
    for (std::size_t i = 0; i < 4; ++i) {
        const bool is_east = (i & 1) != 0, is_north = (i & 2) != 0;
        if (log2_side == SamplePyramid::kCoarsest && children[i] != ResidentSet::kNone) {
            quarters[i].index = children[i];
        } else {
            quarters[i] = {index, half_log2, column + (is_east ? half : 0),
                           row + (is_north ? half : 0)};
        }
    }
    return quarters;
}

WorldRect rect_of(const Lattice& lattice, const Chunk& chunk, const GroundSquare& square) {
    const std::int64_t west = chunk.corner.x + square.column * chunk.step;
    const std::int64_t south = chunk.corner.y + square.row * chunk.step;
    const std::int64_t side = chunk.step << square.log2_side;
    return {lattice.x(west), lattice.y(south), lattice.x(west + side), lattice.y(south + side)};
}

HeightInterval true_heights(const Chunk& chunk, const GroundSquare& square, double quantum) {
    const SampleRange& samples = chunk.pyramid.at(square.log2_side, square.column, square.row);
    const auto bound = static_cast<double>(largest_bound(chunk, square));
    return {quantum * samples.low - bound, quantum * samples.high + bound};
}

bool is_all_ground(const Chunk& chunk, const GroundSquare& square) {
    if (chunk.cell_flags.empty()) return true;
    const int side = 1 << square.log2_side;
    for (int row = square.row; row < square.row + side; ++row) {
        for (int column = square.column; column < square.column + side; ++column) {
            if ((chunk.flags_at(column, row) & cell_outside) != 0) return false;
        }
    }
    return true;
}

}  // namespace terrane::internal
