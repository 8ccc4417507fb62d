// SPDX-License-Identifier: MIT
#include "lod/frame_mesh.h"
#include "lod/key_kernels.h"

#include <algorithm>
#include <array>

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

// Geomorphs.
// Sources:
//   H. Hoppe. Smooth View-Dependent Level-of-Detail Control and its Application to Terrain Rendering.
//   IEEE Visualization 1998. (geomorphs)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. IEEE Visualization 2001. (nested errors)
// Deviations: the share depends on the priority alone, not on time; a vertex morphs from the mean of its ends'
//             displayed, not final, positions; the morphing surface has its own error bound.

Morph::Morph(double ratio, float threshold_key) : is_on_(ratio > 1.0), ratio_(ratio) {
    if (!is_on_) return;
    full_ = ratio * ratio / (ratio * ratio - 1.0);
    error_factor_ = 2.0 * ratio / (ratio + 1.0);
    share_of_.full = static_cast<float>(full_);
    share_of_.slope = share_of_.full / threshold_key;
}

// The functions below take priorities as multiples of the threshold.
double Morph::share(double excess) const {
    return std::clamp(full_ * (1.0 - 1.0 / (excess * excess)), 0.0, 1.0);
}

double Morph::integral(double from, double to) const {
    const double low = std::clamp(from, 1.0, ratio_), high = std::clamp(to, 1.0, ratio_);
    return 2.0 * full_ * std::max(0.0, 1.0 / low - 1.0 / high);
}

double Morph::error_with_missing(double excess) const {
    if (!is_on_) return std::max(excess, 1.0);
    return std::max(error_factor_, integral(excess, ratio_) + share(excess) * excess);
}

double Morph::error_with_held(double excess, double shown) const {
    if (!is_on_ || excess <= shown) return error_factor_;
    return std::max(error_factor_, integral(1.0, shown) + (share(excess) - share(shown)) * excess +
                                       integral(excess, ratio_));
}

double Morph::error_with_fade(double excess, double fade) const {
    if (!is_on_ || excess * fade <= 1.0) return error_with_missing(excess);
    // the vertex is missing for shares between its faded and its own share; for smaller shares, priorities are larger
    // by 1 / fade
    return std::max(error_factor_, integral(excess, ratio_) +
                                       (share(excess) - share(excess * fade)) * excess +
                                       integral(1.0, excess * fade) / fade);
}

// Computes the offset of a vertex from the offsets of its ends at -(to_x, to_y) and +(to_x, to_y).
void Morph::morph_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                         int to_y) const {
    chunk.offsets[sample_index(column, row)] =
        internal::morph_offset(share_less_one(key, share_of_), rise,
                               chunk.offsets[sample_index(column - to_x, row - to_y)],
                               chunk.offsets[sample_index(column + to_x, row + to_y)]);
}

// Computes offsets of a root's active vertices of coarser spacings, coarse to fine.
void Morph::morph_coarse(OpenChunk& root, float threshold, float quantum) const {
    for (const int corner : {0, kChunkCells}) {
        root.offsets[sample_index(corner, 0)] = root.offsets[sample_index(corner, kChunkCells)] =
            0.0f;
    }
    const std::vector<std::int32_t>& heights = root.chunk->heights;
    const auto morph_between = [&](int column, int row, int to_x, int to_y) {
        const float key = root.coarse_key(column, row);
        if (!(key < threshold)) return;
        const std::int32_t height = heights[sample_index(column, row)];
        const std::int32_t end_a = heights[sample_index(column - to_x, row - to_y)];
        const std::int32_t end_b = heights[sample_index(column + to_x, row + to_y)];
        const float rise =
            0.5f * quantum *
            (static_cast<float>(height - end_a) + static_cast<float>(height - end_b));
        morph_vertex(root, rise, key, column, row, to_x, to_y);
    };
    const bool root_rises = cut_to_north_east(root.chunk->key.x, root.chunk->key.y);
    for (int stride = kChunkCells / 2; stride > 1; stride /= 2) {
        bool row_rises = stride < kChunkCells / 2 || root_rises;
        for (int row = stride; row < kChunkCells; row += 2 * stride, row_rises = !row_rises) {
            bool rises = row_rises;
            for (int column = stride; column < kChunkCells; column += 2 * stride, rises = !rises) {
                morph_between(column, row, stride, rises ? stride : -stride);
            }
        }
        bool is_centre_row = false;
        for (int row = 0; row <= kChunkCells; row += stride, is_centre_row = !is_centre_row) {
            for (int column = is_centre_row ? 0 : stride; column <= kChunkCells;
                 column += 2 * stride) {
                morph_between(column, row, is_centre_row ? 0 : stride, is_centre_row ? stride : 0);
            }
        }
    }
}

// Computes offsets of midpoints on the eastern and northern side. They are on the world's border, or owned by a
// neighbour, which computes bit-identical offsets.
void Morph::morph_sides(OpenChunk& chunk, float quantum) const {
    constexpr int kLastArea = kChunkAreas - 1;
    for_each_bit(chunk.active_areas, [&](int area) {
        const int column = area % kChunkAreas, row = area / kChunkAreas;
        if (column == kLastArea) {
            for_each_bit(east_side_bits(chunk, area), [&](int bit) {
                const int at = row * kAreaCells + bit / kAreaSquares * 2 + 1;
                morph_vertex(chunk, chunk.side_rise(east, at, quantum),
                             chunk.key_at(kChunkCells, at), kChunkCells, at, 0, 1);
            });
        }
        if (row == kLastArea) {
            for_each_bit(north_side_bits(chunk, area), [&](int bit) {
                const int at = column * kAreaCells + 2 * bit + 1;
                morph_vertex(chunk, chunk.side_rise(north, at, quantum),
                             chunk.key_at(at, kChunkCells), at, kChunkCells, 1, 0);
            });
        }
    });
}

namespace {

// Bit i: whether row i of an area's squares has an active centre.
unsigned active_rows(const OpenChunk& chunk, int area) {
    std::uint64_t any = chunk.bits_of(area).centre;
    any |= any >> 4;
    any |= any >> 2;
    any |= any >> 1;
    // gathers the lowest bits of the bytes
    return static_cast<unsigned>((any & kFirstColumn) * 0x0102040810204080u >> 56);
}

}  // namespace

void Morph::compute_offsets(OpenChunk& chunk, const KeyKernels& kernels, float threshold,
                            float quantum) const {
    if (chunk.is_root()) morph_coarse(chunk, threshold, quantum);
    AreaMorph part;
    part.share = share_of_;
    const auto coarse_of = [&](int area) {
        const ChunkKey& key = chunk.chunk->key;
        const int shift_x = (key.x & 1) != 0 ? kChunkSquares : 0;
        const int shift_y = (key.y & 1) != 0 ? kChunkSquares : 0;
        return &chunk.parent->offsets[sample_index(shift_x + area % kChunkAreas * kAreaSquares,
                                                   shift_y + area / kChunkAreas * kAreaSquares)];
    };
    const auto morph_area = [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        const OpenChunk::Keys& keys = chunk.keys_of(area);
        part.centre = keys[AreaVertices::centre].data();
        part.along_x = keys[AreaVertices::along_x].data();
        part.along_y = keys[AreaVertices::along_y].data();
        const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
        part.rise = vertices.rise[0].data();
        part.rise_unit = vertices.rise_unit;
        part.offsets = &chunk.offsets[sample_index(west, south)];
        part.rows = active_rows(chunk, area);
        // even samples have the parent's offsets; a root computes its own
        constexpr std::size_t kSide = kAreaSquares + 1;
        std::array<float, kSide * kSide> own;
        if (chunk.is_root()) {
            for (std::size_t i = 0; i < own.size(); ++i) {
                own[i] = part.offsets[2 * (i / kSide * kChunkSamples + i % kSide)];
            }
            part.coarse = own.data();
            part.coarse_stride = kSide;
        } else {
            part.coarse = coarse_of(area);
            part.coarse_stride = kChunkSamples;
        }
        kernels.morph(part);
    };
    for_each_area(chunk.active_areas, morph_area, [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        constexpr std::size_t kBytes = (kAreaCells + 1) * sizeof(float);
        const unsigned rows = active_rows(chunk, area);
        const float* const coarse = chunk.is_root() ? nullptr : coarse_of(area);
        for (int row = 0; row < kAreaSquares; ++row) {
            if ((rows >> row & 1) == 0) continue;
            fetch(&chunk.offsets[sample_index(west, south + 2 * row)], kBytes);
            fetch(&chunk.offsets[sample_index(west, south + 2 * row + 1)], kBytes);
            if (coarse != nullptr) __builtin_prefetch(coarse + row * kChunkSamples);
        }
        fetch(&chunk.keys_of(area), sizeof(OpenChunk::Keys));
        const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
        fetch(&vertices.rise, sizeof vertices.rise);
    });
    morph_sides(chunk, quantum);
}

}  // namespace terrane::internal
