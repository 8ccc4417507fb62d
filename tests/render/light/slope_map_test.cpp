// SPDX-License-Identifier: MIT
#include "light/light_levels.h"
#include "render/scene.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::internal {
namespace slope_map_test {

const Chunk& chunk_at(const ResidentSet& resident, const ChunkKey& key) {
    return *resident.chunks()[static_cast<std::size_t>(resident.find(key))];
}

std::vector<std::int16_t> map_of(const ResidentSet& resident, const ChunkKey& key) {
    return make_slope_map(resident, chunk_at(resident, key), find_side_levels(resident, key));
}

// x and y of a sample of a layer.
std::array<int, 2> slope(const std::vector<std::int16_t>& map, int layer, int column, int row) {
    const auto at = 2 * (static_cast<std::size_t>(slope_layer_row(layer) + row) * kSlopeMapWidth +
                         static_cast<std::size_t>(column));
    return {map[at], map[at + 1]};
}

TEST(SlopeMap, FindsTheFinestChunkOnEachSideThatIsNoFiner) {
    const test::Scene scene = test::make_scene();
    EXPECT_EQ(find_side_levels(*scene.resident, {0, 0, 0}), (SideLevels{-1, 0, -1, -1}));
    EXPECT_EQ(find_side_levels(*scene.resident, {1, 1, 1}), (SideLevels{0, 0, 0, -1}));
}

TEST(SlopeMap, NeighboursOfALevelAgreeOnTheirSharedEdgeInEveryLayer) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> west = map_of(*scene.resident, {0, 0, 0});
    const std::vector<std::int16_t> east = map_of(*scene.resident, {1, 0, 0});
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int last = kChunkCells >> layer;
        for (int row = 0; row <= last; ++row) {
            ASSERT_EQ(slope(west, layer, last, row), slope(east, layer, 0, row))
                << "layer " << layer << " row " << row;
        }
    }
}

TEST(SlopeMap, ALayerOfAChunkIsTheFinerLayerOfItsParent) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> parent = map_of(*scene.resident, {0, 0, 0});
    const std::vector<std::int16_t> child = map_of(*scene.resident, {1, 1, 1});
    for (int layer = 1; layer < kSlopeLayers; ++layer) {
        const int last = kChunkCells >> layer;
        for (int row = 0; row <= last; ++row) {
            for (int column = 0; column <= last; ++column) {
                ASSERT_EQ(slope(child, layer, column, row),
                          slope(parent, layer - 1, last + column, last + row))
                    << "layer " << layer << " column " << column << " row " << row;
            }
        }
    }
}

TEST(SlopeMap, HoldsTheNormalOfTheSurface) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> map = map_of(*scene.resident, {0, 0, 0});
    for (int row = 1; row < kChunkCells; row += 7) {
        for (int column = 1; column < kChunkCells; column += 7) {
            const double x = 2.0 * column, y = 2.0 * row;
            const double east = (scene.height(x + 2.0, y) - scene.height(x - 2.0, y)) / 4.0;
            const double north = (scene.height(x, y + 2.0) - scene.height(x, y - 2.0)) / 4.0;
            const double length = std::sqrt(east * east + north * north + 1.0);
            const std::array<int, 2> packed = slope(map, 0, column, row);
            // one quantum of height over four metres, and half a step of the quantized normal
            EXPECT_NEAR(packed[0] / 32767.0, -east / length, 1.5e-4);
            EXPECT_NEAR(packed[1] / 32767.0, -north / length, 1.5e-4);
        }
    }
}

}  // namespace slope_map_test
}  // namespace terrane::internal
