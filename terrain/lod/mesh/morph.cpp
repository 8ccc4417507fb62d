// SPDX-License-Identifier: MIT
//
// Sources:
//   H. Hoppe. Smooth View-Dependent Level-of-Detail Control and its Application to Terrain Rendering.
//   IEEE Visualization 1998. (geomorphs)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. 2001. (errors that nest)
// Deviations: the share is a function of the priority alone, not of time; vertices morph between the displayed, not
// the final positions of their ends; the morphing surface has its own error bound.
#include "lod/mesh/morph.h"

#include "lod/keys/vertex_morph.h"
#include "lod/mesh/active_set.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
Morph::Morph(double ratio, float threshold_key) : is_on_(ratio > 1.0), ratio_(ratio) {
    if (!is_on_) return;
    full_ = ratio * ratio / (ratio * ratio - 1.0);
    error_factor_ = 2.0 * ratio / (ratio + 1.0);
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
    // missing between its faded and its own share; below the faded share priorities are 1 / fade as large
    return std::max(error_factor_, integral(excess, ratio_) +
                                       (share(excess) - share(excess * fade)) * excess +
                                       integral(1.0, excess * fade) / fade);
}

// The offset of one vertex from those of its ends at -(to_x, to_y) and +(to_x, to_y).
void Morph::morph_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                         int to_y) const {
    chunk.offsets[sample_index(column, row)] =
        internal::morph_offset(share_less_one(key, share_of_), rise,
                               chunk.offsets[sample_index(column - to_x, row - to_y)],
                               chunk.offsets[sample_index(column + to_x, row + to_y)]);
}

// Offsets of a root's vertices of coarser spacings, coarse to fine.
void Morph::morph_coarse(OpenChunk& root, float quantum) const {
    for (const int corner : {0, kChunkCells}) {
        root.offsets[sample_index(corner, 0)] = root.offsets[sample_index(corner, kChunkCells)] =
            0.0f;
    }
    const std::vector<std::int32_t>& heights = root.chunk->heights;
    const auto morph_between = [&](int column, int row, int to_x, int to_y) {
        const std::int32_t height = heights[sample_index(column, row)];
        const std::int32_t end_a = heights[sample_index(column - to_x, row - to_y)];
        const std::int32_t end_b = heights[sample_index(column + to_x, row + to_y)];
        const float rise =
            0.5f * quantum *
            (static_cast<float>(height - end_a) + static_cast<float>(height - end_b));
        morph_vertex(root, rise, root.key_at(column, row), column, row, to_x, to_y);
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

// Midpoints on the eastern and northern side: on the world's border, or a neighbour's, which computes the same bits.
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

void Morph::compute_offsets(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const {
    if (chunk.is_root()) morph_coarse(chunk, quantum);
    AreaMorph part;
    part.share = share_of_;
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
        // even samples have the parent's offsets; a root has computed its own
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
        kernels.morph(part);
    };
    for_each_area(chunk.active_areas, morph_area, [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        for (int row = south; row < south + kAreaCells; ++row) {
            constexpr std::size_t kBytes = (kAreaCells + 1) * sizeof(float);
            fetch(&chunk.offsets[sample_index(west, row)], kBytes);
        }
        fetch(&chunk.keys_of(area), sizeof(OpenChunk::Keys));
        const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
        fetch(&vertices.rise, sizeof vertices.rise);
    });
    morph_sides(chunk, quantum);
}

}  // namespace terrane::internal
