// SPDX-License-Identifier: MIT
//
// Sources:
//   H. Hoppe. Smooth View-Dependent Level-of-Detail Control and its Application to Terrain Rendering.
//   IEEE Visualization 1998. (geomorphs)
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. 2001. (errors that nest)
// Deviations: the share is a function of the priority alone, not of time; ends are taken where they are
// displayed, not where they will be; the morphing surface has a certificate of its own.
#include "morph.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
namespace {

float share_less_one(float key, float full, float slope) {
    return std::clamp(full - slope * key, 0.0f, 1.0f) - 1.0f;
}

}  // namespace

Morph::Morph(double ratio, float threshold_key) : is_on_(ratio > 1.0), ratio_(ratio) {
    if (!is_on_) return;
    full_ = ratio * ratio / (ratio * ratio - 1.0);
    spread_ = 2.0 * ratio / (ratio + 1.0);
    full_share_ = static_cast<float>(full_);
    slope_ = full_share_ / threshold_key;
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

double Morph::with_fade(double excess, double fade) const {
    if (!is_on_ || excess * fade <= 1.0) return with_missing(excess);
    // held from its own share down to the faded one; below that everything counts 1 / fade
    return std::max(spread_, integral(excess, ratio_) +
                                 (share(excess) - share(excess * fade)) * excess +
                                 integral(1.0, excess * fade) / fade);
}

// The vertices of a root that are coarser than its samples, from the coarsest.
void Morph::slide_coarse(OpenChunk& root, float quantum) const {
    const std::vector<std::int32_t>& heights = root.chunk->heights;
    for (const int corner : {0, kChunkCells}) {
        root.offsets[sample_index(corner, 0)] = root.offsets[sample_index(corner, kChunkCells)] =
            0.0f;
    }
    const auto slide = [&](int column, int row, int to_x, int to_y) {
        const std::size_t here = sample_index(column, row);
        const std::size_t a = sample_index(column - to_x, row - to_y);
        const std::size_t b = sample_index(column + to_x, row + to_y);
        const float rise = 0.5f * quantum *
                           (static_cast<float>(heights[here] - heights[a]) +
                            static_cast<float>(heights[here] - heights[b]));
        root.offsets[here] = 0.5f * (root.offsets[a] + root.offsets[b]) +
                             share_less_one(root.keys[here], full_share_, slope_) * rise;
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

void Morph::slide(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const {
    // coarser samples have the offsets that the parent gives them; a root has made its own
    constexpr int kCoarse = kChunkCells / 2 + 1;
    std::array<float, std::size_t{kCoarse} * kCoarse> own;
    const float* coarse = own.data();
    std::size_t stride = kCoarse;
    if (chunk.is_root()) {
        slide_coarse(chunk, quantum);
        for (int row = 0; row < kCoarse; ++row) {
            for (int column = 0; column < kCoarse; ++column) {
                own[static_cast<std::size_t>(row * kCoarse + column)] =
                    chunk.offsets[sample_index(2 * column, 2 * row)];
            }
        }
    } else {
        const int shift_x = (chunk.chunk->key.x & 1) != 0 ? kChunkCells / 2 : 0;
        const int shift_y = (chunk.chunk->key.y & 1) != 0 ? kChunkCells / 2 : 0;
        coarse = &chunk.parent->offsets[sample_index(shift_x, shift_y)];
        stride = kChunkSamples;
    }
    OffsetRow part;
    part.quantum = quantum;
    part.full = full_share_;
    part.slope = slope_;
    for (int row = 0; row <= kChunkCells; ++row) {
        OpenChunk::for_each_run(chunk.active_columns(row), [&](int first, int last) {
            const std::size_t sample = sample_index(first, row);
            part.count = last - first + 1;
            part.keys = &chunk.keys[sample];
            part.heights = &chunk.chunk->heights[sample];
            part.offsets = &chunk.offsets[sample];
            part.coarse = coarse + static_cast<std::size_t>(row / 2) * stride + first / 2;
            if (row % 2 == 0) {
                kernels.slide_even(part);
                return;
            }
            part.coarse_high = part.coarse + stride;
            part.first_is_even_square = (row / 2 + first / 2) % 2 == 0;
            kernels.slide_odd(part);
        });
    }
}

}  // namespace terrane::internal
