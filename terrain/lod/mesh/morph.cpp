// SPDX-License-Identifier: MIT
//
// Sources:
//   H. Hoppe. Smooth View-Dependent Level-of-Detail Control and its Application to Terrain Rendering.
//   IEEE Visualization 1998. (geomorphs)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. 2001. (errors that nest)
// Deviations: the share is a function of the priority alone, not of time; ends are taken where they are
// displayed, not where they will be; the morphing surface has a certificate of its own.
#include "lod/mesh/morph.h"

#include "lod/mesh/active_set.h"
#include "lod/keys/vertex_slide.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
Morph::Morph(double ratio, float threshold_key) : is_on_(ratio > 1.0), ratio_(ratio) {
    if (!is_on_) return;
    full_ = ratio * ratio / (ratio * ratio - 1.0);
    spread_ = 2.0 * ratio / (ratio + 1.0);
    share_of_.full = static_cast<float>(full_);
    share_of_.slope = share_of_.full / threshold_key;
}

// Priorities in thresholds here and below.
double Morph::share(double excess) const {
    return std::clamp(full_ * (1.0 - 1.0 / (excess * excess)), 0.0, 1.0);
}

double Morph::integral(double from, double to) const {
    const double low = std::clamp(from, 1.0, ratio_), high = std::clamp(to, 1.0, ratio_);
    return 2.0 * full_ * std::max(0.0, 1.0 / low - 1.0 / high);
}

double Morph::with_missing(double excess) const {
    if (!is_on_) return std::max(excess, 1.0);
    return std::max(spread_, integral(excess, ratio_) + share(excess) * excess);
}

double Morph::with_held(double excess, double shown) const {
    if (!is_on_ || excess <= shown) return spread_;
    return std::max(spread_, integral(1.0, shown) + (share(excess) - share(shown)) * excess +
                                 integral(excess, ratio_));
}

double Morph::with_fade(double excess, double fade) const {
    if (!is_on_ || excess * fade <= 1.0) return with_missing(excess);
    // held from its own share down to the faded one; below that everything counts 1 / fade
    return std::max(spread_, integral(excess, ratio_) +
                                 (share(excess) - share(excess * fade)) * excess +
                                 integral(1.0, excess * fade) / fade);
}

// A vertex of a chunk, one at a time, from the offsets of its ends: those (to_x, to_y) away, and as far
// the other way.
void Morph::slide_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                         int to_y) const {
    chunk.offsets[sample_index(column, row)] =
        internal::slide(share_less_one(key, share_of_), rise,
                        chunk.offsets[sample_index(column - to_x, row - to_y)],
                        chunk.offsets[sample_index(column + to_x, row + to_y)]);
}

// The vertices of a root that are coarser than its samples, from the coarsest.
void Morph::slide_coarse(OpenChunk& root, float quantum) const {
    for (const int corner : {0, kChunkCells}) {
        root.offsets[sample_index(corner, 0)] = root.offsets[sample_index(corner, kChunkCells)] =
            0.0f;
    }
    const std::vector<std::int32_t>& heights = root.chunk->heights;
    const auto slide = [&](int column, int row, int to_x, int to_y) {
        const std::int32_t height = heights[sample_index(column, row)];
        const std::int32_t end_a = heights[sample_index(column - to_x, row - to_y)];
        const std::int32_t end_b = heights[sample_index(column + to_x, row + to_y)];
        const float rise =
            0.5f * quantum *
            (static_cast<float>(height - end_a) + static_cast<float>(height - end_b));
        slide_vertex(root, rise, root.key_at(column, row), column, row, to_x, to_y);
    };
    const bool root_rises = cut_to_north_east(root.chunk->key.x, root.chunk->key.y);
    for (int stride = kChunkCells / 2; stride > 1; stride /= 2) {
        bool row_rises = stride < kChunkCells / 2 || root_rises;
        for (int row = stride; row < kChunkCells; row += 2 * stride, row_rises = !row_rises) {
            bool rises = row_rises;
            for (int column = stride; column < kChunkCells; column += 2 * stride, rises = !rises) {
                slide(column, row, stride, rises ? stride : -stride);
            }
        }
        bool is_centre_row = false;
        for (int row = 0; row <= kChunkCells; row += stride, is_centre_row = !is_centre_row) {
            for (int column = is_centre_row ? 0 : stride; column <= kChunkCells;
                 column += 2 * stride) {
                slide(column, row, is_centre_row ? 0 : stride, is_centre_row ? stride : 0);
            }
        }
    }
}

// Midpoints on the eastern and northern side: the world's end, or first samples of a neighbour, which
// gives them the same bits.
void Morph::slide_sides(OpenChunk& chunk, float quantum) const {
    constexpr int kLastArea = kChunkAreas - 1;
    for_each_bit(chunk.active_areas, [&](int area) {
        const int column = area % kChunkAreas, row = area / kChunkAreas;
        if (column == kLastArea) {
            for_each_bit(east_side_bits(chunk, area), [&](int bit) {
                const int at = row * kAreaCells + bit / kAreaSquares * 2 + 1;
                slide_vertex(chunk, chunk.side_rise(east, at, quantum),
                             chunk.key_at(kChunkCells, at), kChunkCells, at, 0, 1);
            });
        }
        if (row == kLastArea) {
            for_each_bit(north_side_bits(chunk, area), [&](int bit) {
                const int at = column * kAreaCells + 2 * bit + 1;
                slide_vertex(chunk, chunk.side_rise(north, at, quantum),
                             chunk.key_at(at, kChunkCells), at, kChunkCells, 1, 0);
            });
        }
    });
}

void Morph::slide(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const {
    if (chunk.is_root()) slide_coarse(chunk, quantum);
    AreaSlide part;
    part.share = share_of_;
    const auto slide_area = [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        const OpenChunk::Keys& keys = chunk.keys_of(area);
        part.centre = keys[AreaVertices::centre].data();
        part.along_x = keys[AreaVertices::along_x].data();
        part.along_y = keys[AreaVertices::along_y].data();
        const AreaVertices& vertices = chunk.chunk->vertices[static_cast<std::size_t>(area)];
        part.rise = vertices.rise[0].data();
        part.rise_unit = vertices.rise_unit;
        part.offsets = &chunk.offsets[sample_index(west, south)];
        // coarser samples have the offsets that the parent gives them; a root has made its own
        constexpr std::size_t kSide = kAreaSquares + 1;
        std::array<float, kSide * kSide> own;
        if (chunk.is_root()) {
            for (std::size_t i = 0; i < own.size(); ++i) {
                own[i] = part.offsets[2 * (i / kSide * kChunkSamples + i % kSide)];
            }
            part.coarse = own.data();
            part.coarse_stride = kSide;
        } else {
            const ChunkKey& key = chunk.chunk->key;
            const int shift_x = (key.x & 1) != 0 ? kChunkSquares : 0;
            const int shift_y = (key.y & 1) != 0 ? kChunkSquares : 0;
            part.coarse =
                &chunk.parent->offsets[sample_index(shift_x + west / 2, shift_y + south / 2)];
            part.coarse_stride = kChunkSamples;
        }
        kernels.slide(part);
    };
    for_each_area(chunk.active_areas, slide_area, [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        for (int row = south; row < south + kAreaCells; ++row) {
            constexpr std::size_t kBytes = (kAreaCells + 1) * sizeof(float);
            fetch(&chunk.offsets[sample_index(west, row)], kBytes);
        }
        fetch(&chunk.keys_of(area), sizeof(OpenChunk::Keys));
        const AreaVertices& vertices = chunk.chunk->vertices[static_cast<std::size_t>(area)];
        fetch(&vertices.rise, sizeof vertices.rise);
    });
    slide_sides(chunk, quantum);
}

}  // namespace terrane::internal
