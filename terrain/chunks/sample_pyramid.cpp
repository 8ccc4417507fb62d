// SPDX-License-Identifier: MIT
#include <terrane/terrain/assert.h>
#include <terrane/terrain/sample_pyramid.h>

#include <algorithm>

namespace terrane {
namespace {

SampleRange united(const SampleRange& a, const SampleRange& b) {
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

}  // namespace

void SamplePyramid::fill(std::span<const std::int32_t> heights) {
    TERRANE_ASSERT(heights.size() == std::size_t{kChunkSamples} * kChunkSamples,
                   "a pyramid stands on all samples of a chunk");
    constexpr std::size_t kSide = std::size_t{1} << kFinest;
    for (std::size_t south = 0; south < kChunkCells; south += kSide) {
        // across rows first: columns are contiguous, so it vectorises
        std::array<std::int32_t, kChunkSamples> low;
        std::copy_n(&heights[south * kChunkSamples], kChunkSamples, low.begin());
        std::array<std::int32_t, kChunkSamples> high = low;
        for (std::size_t row = south + 1; row <= south + kSide; ++row) {
            const std::int32_t* const samples = &heights[row * kChunkSamples];
            for (std::size_t column = 0; column < kChunkSamples; ++column) {
                low[column] = std::min(low[column], samples[column]);
                high[column] = std::max(high[column], samples[column]);
            }
        }
        for (std::size_t west = 0; west < kChunkCells; west += kSide) {
            SampleRange range{low[west], high[west]};
            for (std::size_t column = west + 1; column <= west + kSide; ++column) {
                range = united(range, {low[column], high[column]});
            }
            ranges_[index(kFinest, static_cast<int>(west), static_cast<int>(south))] = range;
        }
    }
    for (int size = kFinest + 1; size <= kCoarsest; ++size) {
        const int side = 1 << size, half = side / 2;
        for (int row = 0; row < kChunkCells; row += side) {
            for (int column = 0; column < kChunkCells; column += side) {
                ranges_[index(size, column, row)] =
                    united(united(at(size - 1, column, row), at(size - 1, column + half, row)),
                           united(at(size - 1, column, row + half),
                                  at(size - 1, column + half, row + half)));
            }
        }
    }
}

}  // namespace terrane
