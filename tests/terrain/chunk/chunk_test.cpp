// SPDX-License-Identifier: MIT
#include "chunk/chunk_vertices.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane::chunk_test {

std::shared_ptr<const HeightSource> fractal_at(std::int32_t first_root) {
    return FractalHeights::create({.seed = 2,
                                   .octave_count = 14,
                                   .wavelength_log2 = 10,
                                   .root_size_log2 = 11,
                                   .first_root_x = first_root,
                                   .first_root_y = first_root})
        .value();
}

// Compares the samples that two chunks share.
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
    for (const std::int32_t first_root : {-1, 500'000}) {  // the second origin is 1e9 m away
        const auto source = fractal_at(first_root);
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

TEST(MakeChunk, StoresTheLowestAndHighestSamplesOfItsSquaresAndTheLargestBoundOfItsQuadrants) {
    const auto source = fractal_at(-1);
    const auto chunk = make_chunk(*source, {0, 0, 1}).value();
    EXPECT_EQ(std::ranges::max(chunk->quadrant_bound), std::ranges::max(chunk->cell_bounds));
    EXPECT_LE(chunk->bytes(), Chunk::max_bytes());
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

}  // namespace terrane::chunk_test

namespace terrane::chunk_reaches_test {

using internal::AreaVertices;

std::shared_ptr<const HeightSource> rough_ground() {
    return FractalHeights::create({.seed = 5,
                                   .octave_count = 12,
                                   .amplitude = 400.0,
                                   .wavelength_log2 = 11,
                                   .root_size_log2 = 12})
        .value();
}

// Calls use(column, row) for every vertex that a chunk owns and that is not on its eastern or northern side.
template <typename Use>
void for_each_vertex(const Use& use) {
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = 0; column < kChunkCells; ++column) {
            if (((column | row) & 1) != 0) use(column, row);
        }
    }
}

TEST(Reaches, EncloseTheTrueSurfaceOverTheVertexsDiamond) {
    constexpr std::uint64_t kSeed = 11;
    test::Random random(kSeed);
    const auto source = rough_ground();
    const Lattice& lattice = source->lattice();
    for (const ChunkKey key : {ChunkKey{0, 0, 0}, ChunkKey{-1, 1, 1}, ChunkKey{3, 2, 3}}) {
        const auto chunk = make_chunk(*source, key).value();
        const double spacing = lattice.level_spacing(key.level);
        for_each_vertex([&](int column, int row) {
            const auto [area, kind, square] = AreaVertices::address_of(column, row);
            const AreaVertices& vertices = chunk->vertices->areas[area];
            const double unit = static_cast<double>(chunk->vertices->reach_unit);
            const double low = chunk->vertices->reach_base + unit * vertices.low[kind][square];
            const double high = chunk->vertices->reach_base + unit * vertices.high[kind][square];
            // the diamond of a centre is its square, that of a midpoint is rotated by 45 degrees
            double x = random.between(-1.0, 1.0), y = random.between(-1.0, 1.0);
            if (kind != AreaVertices::centre) {
                const double turned = 0.5 * (x + y);
                y = 0.5 * (x - y);
                x = turned;
            }
            const double height =
                source->height(lattice.x(chunk->corner.x + column * chunk->step) + x * spacing,
                               lattice.y(chunk->corner.y + row * chunk->step) + y * spacing);
            ASSERT_GE(height, low) << column << ", " << row << ", seed " << kSeed;
            ASSERT_LE(height, high) << column << ", " << row << ", seed " << kSeed;
        });
    }
}

TEST(Reaches, AreEnclosedByThoseOfTheirAreaAndChunk) {
    const auto chunk = make_chunk(*rough_ground(), {1, 0, 2}).value();
    for_each_vertex([&](int column, int row) {
        const auto [area, kind, square] = AreaVertices::address_of(column, row);
        const AreaVertices& vertices = chunk->vertices->areas[area];
        const auto of_area = chunk->vertices->area_reaches[area];
        ASSERT_LE(of_area.low, vertices.low[kind][square]);
        ASSERT_GE(of_area.high, vertices.high[kind][square]);
        const HeightInterval reach = chunk->vertices->reach_of_area(static_cast<int>(area));
        ASSERT_LE(chunk->vertex_reach.low, reach.low);
        ASSERT_GE(chunk->vertex_reach.high, reach.high);
    });
}

// Neighbours both store the midpoints of their common side.
TEST(Reaches, AgreeBetweenNeighboursToAFewUnits) {
    const auto source = rough_ground();
    const auto west = make_chunk(*source, {0, 1, 2}).value();
    const auto east = make_chunk(*source, {1, 1, 2}).value();
    for (int row = 1; row < kChunkCells; row += 2) {
        const auto i = static_cast<std::size_t>(row / 2);
        const auto [area, kind, square] = AreaVertices::address_of(0, row);
        const auto metres = [](const Chunk& chunk, std::int16_t units) {
            return chunk.vertices->reach_base +
                   static_cast<double>(chunk.vertices->reach_unit) * units;
        };
        const double margin = 4.0 * static_cast<double>(std::max(west->vertices->reach_unit,
                                                                 east->vertices->reach_unit));
        EXPECT_NEAR(metres(*west, west->vertices->east_side.high[i]),
                    metres(*east, east->vertices->areas[area].high[kind][square]), margin);
        EXPECT_NEAR(metres(*west, west->vertices->east_side.low[i]),
                    metres(*east, east->vertices->areas[area].low[kind][square]), margin);
    }
}

TEST(Rises, AreTheHeightsAboveTheMiddleOfTheSplitEdge) {
    const auto source = rough_ground();
    const auto chunk = make_chunk(*source, {2, 1, 2}).value();
    const auto height = [&](int column, int row) {
        return source->lattice().quantum * chunk->heights[sample_index(column, row)];
    };
    for_each_vertex([&](int column, int row) {
        const auto [area, kind, square] = AreaVertices::address_of(column, row);
        const AreaVertices& vertices = chunk->vertices->areas[area];
        // the ends of a centre are the corners of its square whose indices have an even sum
        const bool rises = (column / 2 + row / 2) % 2 == 0;
        const int to_x = kind == AreaVertices::along_y ? 0 : 1;
        const int to_y = kind == AreaVertices::along_x            ? 0
                         : kind == AreaVertices::along_y || rises ? 1
                                                                  : -1;
        const double middle =
            0.5 * (height(column - to_x, row - to_y) + height(column + to_x, row + to_y));
        const double unit = static_cast<double>(vertices.rise_unit);
        ASSERT_NEAR(unit * vertices.rise[kind][square], height(column, row) - middle, unit)
            << column << ", " << row;
    });
}

}  // namespace terrane::chunk_reaches_test
