// SPDX-License-Identifier: MIT
#include "chunk/chunk_outline.h"

#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace terrane::internal::chunk_outline_test {

ChunkKey descendant(test::Random& random, const ChunkKey& key, int levels) {
    const std::int32_t x = (key.x << levels) + random.below(1 << levels);
    const std::int32_t y = (key.y << levels) + random.below(1 << levels);
    return {x, y, static_cast<std::uint8_t>(key.level + levels)};
}

TEST(ChunkOutline, GivesTheRangesOfTheChunk) {
    constexpr std::uint64_t kSeed = 11;
    test::SeededRandom random(kSeed);
    const test::WaveHeights source(test::small_world(9, 0.5), 90.0, 40.0);
    const double quantum = source.lattice().quantum;
    for (int run = 0; run < 12; ++run) {
        const ChunkKey key = descendant(random, {-1, 0, 0}, 1 + random.below(3));
        const Chunk chunk = *make_chunk(source, key).value();
        for (int levels = 1; levels <= kMostOutlineDepth; ++levels) {
            const int level = key.level + levels;
            const ChunkOutline outline = make_outline(chunk, level, quantum);
            EXPECT_EQ(outline.bytes(), outline_bytes(levels));
            EXPECT_LT(4 * outline.bytes(), chunk.bytes());
            const std::int32_t count = 1 << levels;
            for (std::int32_t y = count * key.y; y < count * (key.y + 1); ++y) {
                for (std::int32_t x = count * key.x; x < count * (key.x + 1); ++x) {
                    const ChunkKey below{x, y, static_cast<std::uint8_t>(level)};
                    ASSERT_EQ(range_over(outline, below), range_over(chunk, below, quantum));
                }
            }
            // other levels: the outline bounds what the chunk bounds
            for (int i = 0; i < 40; ++i) {
                const ChunkKey other = descendant(random, key, 1 + random.below(8));
                const SampleRange wide = range_over(outline, other);
                const SampleRange exact = range_over(chunk, other, quantum);
                ASSERT_LE(wide.low, exact.low);
                ASSERT_GE(wide.high, exact.high);
            }
            for (int quadrant = 0; quadrant < 4; ++quadrant) {
                const auto at = static_cast<std::size_t>(quadrant);
                ASSERT_EQ(outline.quadrant_bound[at], chunk.quadrant_bound[at]);
                SampleRange range{chunk.high, chunk.low};
                for (int row = 0; row <= kChunkCells / 2; ++row) {
                    for (int column = 0; column <= kChunkCells / 2; ++column) {
                        const std::int32_t height =
                            chunk.heights[sample_index(column + quadrant % 2 * kChunkCells / 2,
                                                       row + quadrant / 2 * kChunkCells / 2)];
                        range = {std::min(range.low, height), std::max(range.high, height)};
                    }
                }
                ASSERT_EQ(outline.quadrant_range[at], range);
            }
        }
    }
}

}  // namespace terrane::internal::chunk_outline_test
