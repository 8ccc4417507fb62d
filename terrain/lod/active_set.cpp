// SPDX-License-Identifier: MIT
#include "active_set.h"

namespace terrane::internal {
namespace {

constexpr int kCentres = kChunkCells / 2;  // in a row

// The even bits of a word, together in its lower half.
std::uint64_t even_bits(std::uint64_t word) {
    word &= 0x5555555555555555u;
    word = (word | (word >> 1)) & 0x3333333333333333u;
    word = (word | (word >> 2)) & 0x0f0f0f0f0f0f0f0fu;
    word = (word | (word >> 4)) & 0x00ff00ff00ff00ffu;
    word = (word | (word >> 8)) & 0x0000ffff0000ffffu;
    return (word | (word >> 16)) & 0x00000000ffffffffu;
}

// Centres of the children over one row of the chunk's cells, west and east half.
void child_row(const OpenChunk& chunk, int cell_row, std::uint64_t& west_out,
               std::uint64_t& east_out) {
    const std::size_t quadrant = cell_row < kCentres ? 0 : 2;
    const auto row = static_cast<std::size_t>(cell_row % kCentres);
    const OpenChunk* west_child = chunk.child[quadrant];
    const OpenChunk* east_child = chunk.child[quadrant + 1];
    west_out = west_child == nullptr ? 0 : west_child->centre[row];
    east_out = east_child == nullptr ? 0 : east_child->centre[row];
}

// Eight centres of a row are an area's: those bytes that are not zero, a bit each.
std::uint8_t bytes_in_use(std::uint64_t word) {
    unsigned used = 0;
    for (unsigned byte = 0; byte < 8; ++byte) {
        used |= static_cast<unsigned>((word >> (8 * byte) & 0xff) != 0) << byte;
    }
    return static_cast<std::uint8_t>(used);
}

}  // namespace

void mark_active(OpenChunk& chunk, const KeyKernels& kernels, float threshold) {
    chunk.along_y_east = 0;
    std::uint64_t unused = 0;
    for (int line = 0; line <= kCentres; ++line) {
        const auto i = static_cast<std::size_t>(line);
        chunk.along_x[i] = 0;
        if (chunk.open_columns(2 * line) != 0) {
            kernels.mask(chunk.key_row(2 * line), threshold, unused, chunk.along_x[i]);
        }
        if (line == kCentres) break;
        chunk.along_y[i] = chunk.centre[i] = 0;
        if (chunk.open_columns(2 * line + 1) == 0) continue;
        const float* keys = chunk.key_row(2 * line + 1);
        kernels.mask(keys, threshold, chunk.along_y[i], chunk.centre[i]);
        chunk.along_y_east |= static_cast<std::uint64_t>(keys[kChunkCells] < threshold) << line;
    }
    constexpr int kAreaCentres = kAreaCells / 2;
    for (std::size_t area = 0; area < kChunkAreas; ++area) {
        std::uint64_t any = 0;
        for (std::size_t i = 0; i < kAreaCentres; ++i) any |= chunk.centre[kAreaCentres * area + i];
        chunk.active_areas[area] = bytes_in_use(any);
    }
}

SquareRow square_row(const OpenChunk& chunk, int row) {
    const auto i = static_cast<std::size_t>(row);
    SquareRow squares;
    squares.centre = chunk.centre[i];
    if (squares.centre == 0) return squares;
    squares.split[0] = chunk.along_x[i];
    squares.split[1] = (chunk.along_y[i] >> 1) | (((chunk.along_y_east >> row) & 1) << 63);
    squares.split[2] = chunk.along_x[i + 1];
    squares.split[3] = chunk.along_y[i];
    std::uint64_t west_half = 0, east_half = 0;
    child_row(chunk, 2 * row, west_half, east_half);
    if ((west_half | east_half) != 0) {
        squares.divided[0] = even_bits(west_half) | (even_bits(east_half) << 32);
        squares.divided[1] = even_bits(west_half >> 1) | (even_bits(east_half >> 1) << 32);
    }
    child_row(chunk, 2 * row + 1, west_half, east_half);
    if ((west_half | east_half) != 0) {
        squares.divided[3] = even_bits(west_half) | (even_bits(east_half) << 32);
        squares.divided[2] = even_bits(west_half >> 1) | (even_bits(east_half >> 1) << 32);
    }
    return squares;
}

}  // namespace terrane::internal
