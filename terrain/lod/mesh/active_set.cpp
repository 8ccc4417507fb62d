// SPDX-License-Identifier: MIT
#include "lod/mesh/active_set.h"

namespace terrane::internal {
namespace {

constexpr std::uint64_t kFirstColumn = 0x0101010101010101u;
constexpr std::uint64_t kFirstRow = 0xffu;

// Moves bit i of a byte to the first bit of row i.
std::uint64_t to_column(std::uint64_t byte) {
    std::uint64_t column = 0;
    for (unsigned i = 0; i < 8; ++i) column |= (byte >> i & 1) << (8 * i);
    return column;
}

// Compresses every second bit of every second row of 8 x 8 to 4 x 4, in the first rows and columns.
std::uint64_t every_second(std::uint64_t bits) {
    bits &= 0x0055005500550055u;
    bits = (bits | bits >> 1) & 0x0033003300330033u;
    bits = (bits | bits >> 2) & 0x000f000f000f000fu;
    bits = (bits | bits >> 8) & 0x00000f0f00000f0fu;
    return (bits | bits >> 16) & 0x000000000f0f0f0fu;
}

// Sets the quarters that the child's centres divide.
void find_divided(const OpenChunk& chunk, int area, AreaBits& bits) {
    constexpr int kHalf = kChunkAreas / 2;
    const int column = area % kChunkAreas, row = area / kChunkAreas;
    const OpenChunk* child =
        chunk.child[static_cast<std::size_t>(column / kHalf + 2 * (row / kHalf))];
    if (child == nullptr) return;
    for (int part = 0; part < 4; ++part) {
        const int x = part % 2, y = part / 2;
        const int below = (row % kHalf * 2 + y) * kChunkAreas + column % kHalf * 2 + x;
        const std::uint64_t centres = child->bits_of(below).centre;
        if (centres == 0) continue;
        const int shift = 4 * x + 32 * y;
        bits.divided[0] |= every_second(centres) << shift;
        bits.divided[1] |= every_second(centres >> 1) << shift;
        bits.divided[2] |= every_second(centres >> 9) << shift;
        bits.divided[3] |= every_second(centres >> 8) << shift;
    }
}

}  // namespace

void mark_active(OpenChunk& chunk, const KeyKernels& kernels, float threshold) {
    chunk.bits.fill({});
    chunk.active_areas = 0;
    for_each_bit(chunk.open_areas, [&](int area) {
        const OpenChunk::Keys& keys = chunk.keys_of(area);
        OpenChunk::Bits& bits = chunk.bits[static_cast<std::size_t>(area)];
        bits.centre = kernels.mask(keys[AreaVertices::centre].data(), threshold);
        if (bits.centre == 0) return;  // midpoints need an active centre
        bits.along_x = kernels.mask(keys[AreaVertices::along_x].data(), threshold);
        bits.along_y = kernels.mask(keys[AreaVertices::along_y].data(), threshold);
        chunk.active_areas |= std::uint64_t{1} << area;
    });
    const auto of_side = [&](Side side, const auto& keys) {
        return chunk.at_world_border[side] ? kernels.mask(keys.data(), threshold)
                                           : std::uint64_t{0};
    };
    chunk.east_bits = of_side(east, chunk.east_keys);
    chunk.north_bits = of_side(north, chunk.north_keys);
}

std::uint64_t east_side_bits(const OpenChunk& chunk, int area) {
    if (is_world_border(chunk, area, east)) {
        return to_column(chunk.east_bits >> (area / kChunkAreas * kAreaSquares) & kFirstRow);
    }
    const AreaRef adjacent = adjacent_area(chunk, area, east);
    return adjacent.chunk == nullptr
               ? 0
               : adjacent.chunk->bits_of(adjacent.area).along_y & kFirstColumn;
}

std::uint64_t north_side_bits(const OpenChunk& chunk, int area) {
    if (is_world_border(chunk, area, north)) {
        return chunk.north_bits >> (area % kChunkAreas * kAreaSquares) & kFirstRow;
    }
    const AreaRef adjacent = adjacent_area(chunk, area, north);
    return adjacent.chunk == nullptr ? 0
                                     : adjacent.chunk->bits_of(adjacent.area).along_x & kFirstRow;
}

AreaBits area_bits(const OpenChunk& chunk, int area) {
    const OpenChunk::Bits& own = chunk.bits_of(area);
    AreaBits bits;
    if (own.centre == 0) return bits;
    bits.centre = own.centre;
    bits.split[0] = own.along_x;
    bits.split[1] = (own.along_y >> 1 & ~(kFirstColumn << 7)) | east_side_bits(chunk, area) << 7;
    bits.split[2] = own.along_x >> 8 | north_side_bits(chunk, area) << 56;
    bits.split[3] = own.along_y;
    find_divided(chunk, area, bits);
    return bits;
}

}  // namespace terrane::internal
