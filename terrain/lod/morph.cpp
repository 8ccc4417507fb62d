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
#include <bit>
#include <cmath>

namespace terrane::internal {
namespace {

// ln(x) for x >= 1, rounded up by at most (ln x)^3 / 24.
double ln_above(double x) { return (x - 1.0) / std::sqrt(x); }

float share_less_one(float key, float full, float slope) {
    return std::clamp(full - slope * std::sqrt(key), 0.0f, 1.0f) - 1.0f;
}

}  // namespace

Morph::Morph(double ratio, float threshold_key) : is_on_(ratio > 1.0), ratio_(ratio) {
    if (!is_on_) return;
    full_ = ratio / (ratio - 1.0);
    spread_ = std::sqrt(ratio);
    full_share_ = static_cast<float>(full_);
    slope_ = static_cast<float>(full_ / std::sqrt(static_cast<double>(threshold_key)));
}

double Morph::share(double priority) const {
    return std::clamp(full_ * (1.0 - 1.0 / priority), 0.0, 1.0);
}

double Morph::with_missing(double excess) const {
    if (!is_on_ || excess >= ratio_) return std::max(excess, 1.0);
    if (excess <= 1.0) return spread_;
    // a chord of a convex function
    return spread_ + (excess - 1.0) / (ratio_ - 1.0) * (ratio_ - spread_);
}

double Morph::with_fade(double excess, double fade) const {
    if (!is_on_) return with_missing(excess);
    if (excess * fade <= 1.0) return with_missing(excess);
    // held from its own share down to the faded one, and below it everything counts 1 / fade
    const double full_share = share(excess);
    const double faded_share = share(excess * fade);
    const double above = excess >= ratio_ ? 0.0 : full_ * ln_above(ratio_ / excess);
    const double below = full_ * ln_above(std::min(excess * fade, ratio_)) / fade;
    return std::max(spread_, above + (full_share - faded_share) * excess + below);
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
        for (int row = stride; row < kChunkCells; row += 2 * stride) {
            for (int column = stride; column < kChunkCells; column += 2 * stride) {
                const bool rises = stride == kChunkCells / 2
                                       ? root_rises
                                       : ((column / stride + row / stride) / 2) % 2 == 1;
                slide(column, row, stride, rises ? stride : -stride);
            }
        }
        for (int row = 0; row <= kChunkCells; row += stride) {
            const bool is_centre_row = (row / stride) % 2 != 0;
            for (int column = is_centre_row ? 0 : stride; column <= kChunkCells;
                 column += 2 * stride) {
                slide(column, row, is_centre_row ? 0 : stride, is_centre_row ? stride : 0);
            }
        }
    }
}

// Coarser samples have the offsets that the parent gives them.
void Morph::take_from_parent(OpenChunk& chunk) const {
    const int shift_x = (chunk.chunk->key.x & 1) != 0 ? kChunkCells / 2 : 0;
    const int shift_y = (chunk.chunk->key.y & 1) != 0 ? kChunkCells / 2 : 0;
    for (int row = 0; row <= kChunkCells; row += 2) {
        const float* from = &chunk.parent->offsets[sample_index(shift_x, shift_y + row / 2)];
        float* to = &chunk.offsets[sample_index(0, row)];
        OpenChunk::for_each_run(chunk.open_columns(row), [&](int first, int last) {
            for (int column = first; column <= last; column += 2) to[column] = from[column / 2];
        });
    }
}

void Morph::slide(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const {
    if (chunk.is_root()) {
        slide_coarse(chunk, quantum);
    } else {
        take_from_parent(chunk);
    }
    OffsetRow part;
    part.quantum = quantum;
    part.full = full_share_;
    part.slope = slope_;
    for (int row = 0; row <= kChunkCells; ++row) {
        OpenChunk::for_each_run(chunk.open_columns(row), [&](int first, int last) {
            const std::size_t sample = sample_index(first, row);
            part.count = last - first + 1;
            part.keys = &chunk.keys[sample];
            part.heights = &chunk.chunk->heights[sample];
            part.offsets = &chunk.offsets[sample];
            if (row % 2 == 0) {
                kernels.slide_even(part);
                return;
            }
            part.heights_low = part.heights - kChunkSamples;
            part.heights_high = part.heights + kChunkSamples;
            part.offsets_low = part.offsets - kChunkSamples;
            part.offsets_high = part.offsets + kChunkSamples;
            part.first_is_even_square = (row / 2 + first / 2) % 2 == 0;
            kernels.slide_odd(part);
        });
    }
}

}  // namespace terrane::internal
