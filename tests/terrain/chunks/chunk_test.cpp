// SPDX-License-Identifier: MIT
#include "chunk/chunk_vertices.h"
#include "support/heights/wave_heights.h"
#include "support/random.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>

namespace terrane {
namespace chunk_test {

std::shared_ptr<const HeightSource> fractal_at(std::int32_t first_root) {
    const auto source = FractalHeights::create({.seed = 2,
                                                .octave_count = 14,
                                                .wavelength_log2 = 10,
                                                .root_size_log2 = 11,
                                                .first_root_x = first_root,
                                                .first_root_y = first_root});
    return source ? *source : nullptr;
}

// Compares the samples of two chunks at their common lattice points.
void expect_shared_samples_equal(const Chunk& a, const Chunk& b) {
    int shared = 0;
    for (int row = 0; row < kChunkSamples; ++row) {
        for (int column = 0; column < kChunkSamples; ++column) {
            const std::int64_t dx = a.corner.x + column * a.step - b.corner.x;
            const std::int64_t dy = a.corner.y + row * a.step - b.corner.y;
            if (dx < 0 || dy < 0 || dx % b.step != 0 || dy % b.step != 0) continue;
            if (dx / b.step > kChunkCells || dy / b.step > kChunkCells) continue;
            ASSERT_EQ(a.heights[sample_index(column, row)],
                      b.heights[sample_index(static_cast<int>(dx / b.step),
                                             static_cast<int>(dy / b.step))]);
            ++shared;
        }
    }
    EXPECT_GT(shared, 0);
}

TEST(MakeChunk, GivesNeighboursOfAllLevelPairsTheSameEdge) {
    for (const std::int32_t first_root : {-1, 500'000}) {  // the second is 1e9 m away
        const auto source = fractal_at(first_root);
        ASSERT_NE(source, nullptr);
        const int finest = source->lattice().finest_level;
        // chunks west and east of the middle of the world
        for (int west = 0; west <= finest; ++west) {
            for (int east = 0; east <= finest; ++east) {
                SCOPED_TRACE(testing::Message()
                             << "root " << first_root << ", levels " << west << ", " << east);
                const std::int32_t middle = first_root + 1;
                const Chunk a = **make_chunk(*source, {(middle << west) - 1, middle << west,
                                                       static_cast<std::uint8_t>(west)});
                const Chunk b = **make_chunk(
                    *source, {middle << east, middle << east, static_cast<std::uint8_t>(east)});
                expect_shared_samples_equal(a, b);
            }
        }
    }
}

TEST(MakeChunk, GivesNeighboursTheSameBoundsOnTheirEdge) {
    const auto source = fractal_at(-1);
    ASSERT_NE(source, nullptr);
    for (std::uint8_t level = 0; level <= source->lattice().finest_level; ++level) {
        const auto west = make_chunk(*source, {-1, 0, level}).value();
        const auto east = make_chunk(*source, {0, 0, level}).value();
        for (int row = 0; row < kChunkSamples; ++row) {
            EXPECT_EQ(west->vertices->inverse_square_bound(kChunkCells, row),
                      east->vertices->inverse_square_bound(0, row))
                << "level " << int{level} << ", row " << row;
        }
    }
}

TEST(MakeChunk, RoundsHeightsToTheNearestQuantum) {
    const test::WaveHeights source(test::small_world(2, 0.3), 17.0, 90.0);
    const auto chunk = make_chunk(source, {0, -1, 2}).value();
    const Lattice& lattice = source.lattice();
    for (int i = 0; i < kChunkSamples; i += 7) {
        const double height =
            source.height(lattice.x(chunk->corner.x + i), lattice.y(chunk->corner.y + 5));
        EXPECT_LE(std::abs(lattice.quantum * chunk->heights[sample_index(i, 5)] - height),
                  0.5 * lattice.quantum);
    }
}

TEST(MakeChunk, StoresTheLowestAndHighestSamplesOfItsSquares) {
    const auto source = fractal_at(-1);
    ASSERT_NE(source, nullptr);
    const auto chunk = make_chunk(*source, {0, 0, 1}).value();
    for (int size = SamplePyramid::kFinest; size <= SamplePyramid::kCoarsest; ++size) {
        const int side = 1 << size;
        for (int south = 0; south < kChunkCells; south += side) {
            for (int west = 0; west < kChunkCells; west += side) {
                std::vector<std::int32_t> samples;
                for (int row = south; row <= south + side; ++row) {
                    for (int column = west; column <= west + side; ++column) {
                        samples.push_back(chunk->heights[sample_index(column, row)]);
                    }
                }
                const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
                const SampleRange expected{*low, *high};
                ASSERT_EQ(chunk->pyramid.at(size, west, south), expected);
                ASSERT_EQ(chunk->pyramid.at(size, west + side - 1, south + side - 1), expected);
                if (side == kAreaCells) {
                    const auto area =
                        static_cast<std::size_t>(south / side * kChunkAreas + west / side);
                    ASSERT_EQ(chunk->areas[area].low, expected.low);
                    ASSERT_EQ(chunk->areas[area].high, expected.high);
                }
                if (side == kChunkCells) {
                    ASSERT_EQ(chunk->low, expected.low);
                    ASSERT_EQ(chunk->high, expected.high);
                }
            }
        }
    }
}

TEST(MakeChunk, BoundsQuadrantsByTheirCells) {
    const auto source = fractal_at(-1);
    ASSERT_NE(source, nullptr);
    const auto chunk = make_chunk(*source, {0, 0, 1}).value();
    float largest = 0.0f;
    for (const float bound : chunk->cell_bounds) largest = std::max(largest, bound);
    EXPECT_EQ(*std::max_element(chunk->quadrant_bound.begin(), chunk->quadrant_bound.end()),
              largest);
    EXPECT_LE(chunk->bytes(), Chunk::max_bytes());
}

TEST(MakeChunk, RefusesHeightsThatAreNaN) {
    test::WaveHeights source(test::small_world(2, 1.0), 17.0, 90.0);
    source.gives_nan = true;
    const auto refused = make_chunk(source, {0, 0, 0});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_data);
    source.gives_nan = false;
    source.is_broken = true;
    EXPECT_EQ(make_chunk(source, {0, 0, 0}).error().code, ErrorCode::io);
}

}  // namespace chunk_test
}  // namespace terrane
