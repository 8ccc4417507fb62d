// SPDX-License-Identifier: MIT
#include "chunk/chunk_vertices.h"
#include "support/random.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>

namespace terrane {
namespace chunk_reaches_test {

using internal::AreaVertices;

std::shared_ptr<const HeightSource> rough_ground() {
    return FractalHeights::create({.seed = 5,
                                   .octave_count = 12,
                                   .amplitude = 400.0,
                                   .wavelength_log2 = 11,
                                   .root_size_log2 = 12})
        .value();
}

// Calls use(column, row) for every own vertex of a chunk that is not on its eastern or northern side.
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
            // a centre's diamond is its square, a midpoint's is rotated by 45 degrees
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

// Both neighbours store the midpoints on their common side.
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
        // the ends of a centre are the corners of its square with an even index sum
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

}  // namespace chunk_reaches_test
}  // namespace terrane
