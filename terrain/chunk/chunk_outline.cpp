// SPDX-License-Identifier: MIT
#include "chunk/chunk_outline.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

// The largest error bound of the cells of an aligned square.
float largest_bound(const Chunk& chunk, int west, int south, int side) {
    float bound = 0.0f;
    if (side >= kAreaCells) {
        for (int row = south / kAreaCells; row < (south + side) / kAreaCells; ++row) {
            for (int column = west / kAreaCells; column < (west + side) / kAreaCells; ++column) {
                const auto area = static_cast<std::size_t>(row * kChunkAreas + column);
                bound = std::max(bound, chunk.areas[area].max_cell_bound);
            }
        }
        return bound;
    }
    for (int row = south; row < south + side; ++row) {
        for (int column = west; column < west + side; ++column) {
            bound = std::max(bound, chunk.cell_bounds[cell_index(column, row)]);
        }
    }
    return bound;
}

// By a bound in metres, rounded up to quanta, and by one more quantum.
SampleRange widened(const SampleRange& samples, float bound, double quantum) {
    constexpr double kMost = 0x1p40;  // beyond any sample
    const double exact = std::min(static_cast<double>(bound) / quantum, kMost);
    const auto cut = static_cast<std::int64_t>(exact);  // faster than std::ceil() on old processors
    const double margin = static_cast<double>(cut) + (static_cast<double>(cut) < exact ? 2.0 : 1.0);
    const auto clamp = [](double quanta) {
        return static_cast<std::int32_t>(std::clamp(quanta, -2147483648.0, 2147483647.0));
    };
    return {clamp(samples.low - margin), clamp(samples.high + margin)};
}

}  // namespace

SampleRange range_over(const Chunk& chunk, const ChunkKey& descendant, double quantum) {
    // the chunk's cells over the descendant, at least one
    const int below = descendant.level - chunk.key.level;
    const int side = std::max(kChunkCells >> below, 1);
    const auto cell_of = [&](std::int32_t index, std::int32_t first) {
        const std::int64_t chunks = index - (std::int64_t{first} << below);
        return static_cast<int>((chunks * kChunkCells) >> below);
    };
    const int west = cell_of(descendant.x, chunk.key.x);
    const int south = cell_of(descendant.y, chunk.key.y);
    const int log2_side = std::countr_zero(static_cast<unsigned>(side));
    return widened(chunk.samples_in(log2_side, west, south),
                   largest_bound(chunk, west, south, side), quantum);
}

SampleRange range_over(const ChunkOutline& outline, const ChunkKey& descendant) {
    const int below = outline.level - outline.key.level;
    // chunks of the outline's level over the descendant
    const int coarser = std::max(outline.level - descendant.level, 0);
    const int finer = std::max(descendant.level - outline.level, 0);
    const auto first_of = [&](std::int32_t index, std::int32_t corner) {
        const std::int64_t at = (std::int64_t{index} << coarser) >> finer;
        return static_cast<std::size_t>(at - (std::int64_t{corner} << below));
    };
    const std::size_t west = first_of(descendant.x, outline.key.x);
    const std::size_t south = first_of(descendant.y, outline.key.y);
    const std::size_t count = std::size_t{1} << coarser;
    SampleRange all = outline.ranges[(south << below) + west];
    for (std::size_t row = south; row < south + count; ++row) {
        for (std::size_t column = west; column < west + count; ++column) {
            const SampleRange& range = outline.ranges[(row << below) + column];
            all = {std::min(all.low, range.low), std::max(all.high, range.high)};
        }
    }
    return all;
}

SampleRange range_of_quadrant(const Chunk& chunk, int quadrant) {
    constexpr int kHalf = kChunkCells / 2;
    static_assert(kHalf == 1 << 6);
    return chunk.pyramid.at(6, (quadrant & 1) * kHalf, (quadrant >> 1) * kHalf);
}

namespace {

using BoundRow = std::array<float, kChunkCells>;

// Largest bounds of the cells of each aligned square of a row of squares.
void find_largest_bounds(const Chunk& chunk, int south, int side, BoundRow& bounds_out) {
    if (side >= kAreaCells) {
        for (int west = 0; west < kChunkCells; west += side) {
            bounds_out[static_cast<std::size_t>(west / side)] =
                largest_bound(chunk, west, south, side);
        }
        return;
    }
    // rows first: columns are contiguous, so that the loop vectorises
    BoundRow row_bounds;
    std::copy_n(&chunk.cell_bounds[cell_index(0, south)], kChunkCells, row_bounds.begin());
    for (int row = south + 1; row < south + side; ++row) {
        const float* const bounds = &chunk.cell_bounds[cell_index(0, row)];
        for (std::size_t column = 0; column < kChunkCells; ++column) {
            const float a = row_bounds[column], b = bounds[column];
            row_bounds[column] = a < b ? b : a;
        }
    }
    std::size_t count = kChunkCells;
    for (int across = 1; across < side; across *= 2) {
        count /= 2;
        for (std::size_t i = 0; i < count; ++i) {
            row_bounds[i] = std::max(row_bounds[2 * i], row_bounds[2 * i + 1]);
        }
    }
    std::copy_n(row_bounds.begin(), count, bounds_out.begin());
}

using RangeRow = std::array<SampleRange, kChunkCells / 2>;

// Ranges of the samples of each aligned square of a row of squares.
void find_ranges(const Chunk& chunk, int south, int side, RangeRow& ranges_out) {
    const auto log2_side = std::countr_zero(static_cast<unsigned>(side));
    if (log2_side >= SamplePyramid::kFinest) {
        for (int west = 0; west < kChunkCells; west += side) {
            ranges_out[static_cast<std::size_t>(west / side)] =
                chunk.pyramid.at(log2_side, west, south);
        }
        return;
    }
    std::array<std::int32_t, kChunkSamples> low, high;
    std::copy_n(&chunk.heights[sample_index(0, south)], kChunkSamples, low.begin());
    high = low;
    for (int row = south + 1; row <= south + side; ++row) {
        const std::int32_t* const samples = &chunk.heights[sample_index(0, row)];
        for (std::size_t column = 0; column < kChunkSamples; ++column) {
            low[column] = std::min(low[column], samples[column]);
            high[column] = std::max(high[column], samples[column]);
        }
    }
    const auto across = static_cast<std::size_t>(side);
    for (std::size_t west = 0; west < kChunkCells; west += across) {
        SampleRange range{low[west], high[west]};
        for (std::size_t column = west + 1; column <= west + across; ++column) {
            range = {std::min(range.low, low[column]), std::max(range.high, high[column])};
        }
        ranges_out[west / across] = range;
    }
}

}  // namespace

ChunkOutline make_outline(const Chunk& chunk, int level, double quantum) {
    const int below = level - chunk.key.level;
    TERRANE_ASSERT(below > 0 && below <= kMostOutlineDepth, "a chunk a few levels above contact");
    ChunkOutline outline{.key = chunk.key,
                         .level = static_cast<std::uint8_t>(level),
                         .quadrant_bound = chunk.quadrant_bound,
                         .ranges = {}};
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        outline.quadrant_range[static_cast<std::size_t>(quadrant)] =
            range_of_quadrant(chunk, quadrant);
    }
    const int side = kChunkCells >> below;
    const std::size_t count = std::size_t{1} << below;
    outline.ranges.reserve(count * count);
    BoundRow bounds;
    RangeRow ranges;
    for (int south = 0; south < kChunkCells; south += side) {
        find_largest_bounds(chunk, south, side, bounds);
        find_ranges(chunk, south, side, ranges);
        for (std::size_t i = 0; i < count; ++i) {
            outline.ranges.push_back(widened(ranges[i], bounds[i], quantum));
        }
    }
    return outline;
}

}  // namespace terrane::internal
