// SPDX-License-Identifier: MIT
#include "support/heights/wave_heights.h"

#include <terrane/adapters/heightmap.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

namespace terrane::adapters {
namespace heightmap_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create({.seed = 9, .finest_spacing_log2 = 1, .root_size_log2 = 10})
        .value();
}

TEST(Heightmap, HasTheHeightsOfTheSourceRowByRowFromTheNorth) {
    const auto source = hills();
    const Heightmap map = make_heightmap(*source, {.centre_x = 13.1,
                                                   .centre_y = -31.0,
                                                   .side = 129,
                                                   .level = source->lattice().finest_level})
                              .value();
    EXPECT_EQ(map.spacing, 2.0);
    EXPECT_EQ(map.width(), 256.0);
    EXPECT_EQ(map.west, 14.0 - 128.0);  // the nearest point of the lattice
    ASSERT_EQ(map.heights.size(), 129u * 129u);
    double low = map.heights[0], high = low;
    for (int row = 0; row < map.side; ++row) {
        for (int column = 0; column < map.side; ++column) {
            const double height = map.heights[static_cast<std::size_t>(row * map.side + column)];
            ASSERT_NEAR(height, source->height(map.west + 2.0 * column, map.north - 2.0 * row),
                        1e-9);
            low = std::min(low, height);
            high = std::max(high, height);
        }
    }
    EXPECT_EQ(map.low, low);
    EXPECT_EQ(map.high, high);
    EXPECT_EQ(map.absent_count, 0);
}

TEST(Heightmap, RoundsToSixteenBitsWithinTheErrorThatItTells) {
    const auto source = hills();
    const Heightmap map = make_heightmap(*source, {.side = 257, .level = 2}).value();
    const std::vector<std::uint16_t> pixels = quantise(map);
    double largest = 0.0;
    std::uint16_t least = 65535, most = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double height = map.low + pixels[i] / 65535.0 * (map.high - map.low);
        largest = std::max(largest, std::abs(height - map.heights[i]));
        least = std::min(least, pixels[i]);
        most = std::max(most, pixels[i]);
    }
    EXPECT_EQ(least, 0);
    EXPECT_EQ(most, 65535);
    EXPECT_LE(largest, quantisation_error(map));
    EXPECT_GT(largest, 0.9 * quantisation_error(map));
}

TEST(Heightmap, OfFlatGroundIsAllZeroAndHasASize) {
    const test::WaveHeights flat(test::small_world(3, 1.0), 0.0, 64.0);
    const Heightmap map = make_heightmap(flat, {.side = 65, .level = 3}).value();
    for (const std::uint16_t pixel : quantise(map)) ASSERT_EQ(pixel, 0);
    EXPECT_EQ(quantisation_error(map), 0.0);
    EXPECT_NE(sdf_model(map, "flat", "flat.png").find("<size>64 64 1</size>"), std::string::npos);
}

TEST(Heightmap, IsPlacedByItsModel) {
    const auto source = hills();
    const Heightmap map =
        make_heightmap(*source, {.centre_x = 100.0, .centre_y = 40.0, .side = 65, .level = 2})
            .value();
    const std::string sdf = sdf_model(map, "a<b", "x&y.png", {90.0, 30.0, map.low});
    EXPECT_NE(sdf.find("<pos>" + number_text(map.west + 0.5 * map.width() - 90.0) + " " +
                       number_text(map.north - 0.5 * map.width() - 30.0) + " 0</pos>"),
              std::string::npos)
        << sdf;
    EXPECT_NE(sdf.find("name=\"a&lt;b\""), std::string::npos);
    EXPECT_NE(sdf.find("<uri>x&amp;y.png</uri>"), std::string::npos);
}

TEST(Heightmap, HasNoHolesUnlessSomethingStandsThere) {
    const test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    const WorldRect& extent = source.extent();
    HeightmapSettings settings{.centre_x = extent.east, .centre_y = 0.0, .side = 65, .level = 3};
    const Result<Heightmap> refused = make_heightmap(source, settings);
    ASSERT_FALSE(refused);
    // the columns east of the extent
    EXPECT_EQ(refused.error().message, "a heightmap has no holes, and " + number_text(32 * 65) +
                                           " of its 4225 samples are no ground");
    settings.absent_height = -7.5;
    const Heightmap map = make_heightmap(source, settings).value();
    EXPECT_EQ(map.absent_count, 32 * 65);
    for (int row = 0; row < 65; ++row) {
        for (int column = 0; column < 65; ++column) {
            const double x = map.west + column, y = map.north - row;
            const double want = x > extent.east ? -7.5 : source.height(x, y);
            ASSERT_NEAR(map.heights[static_cast<std::size_t>(row * 65 + column)], want, 1e-9);
        }
    }
    settings.centre_x = -1e9;
    EXPECT_EQ(make_heightmap(source, settings).value().absent_count, 65 * 65);
}

TEST(Heightmap, TellsOfSourcesThatFail) {
    test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    source.gives_nan = true;
    const Result<Heightmap> no_number = make_heightmap(source, {.side = 5, .level = 3});
    ASSERT_FALSE(no_number);
    EXPECT_EQ(no_number.error().code, ErrorCode::bad_data);
    source.is_broken = true;
    EXPECT_FALSE(make_heightmap(source, {.side = 5, .level = 3}));
}

TEST(Heightmap, RefusesSettingsOutOfRange) {
    const test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    for (const HeightmapSettings& settings :
         {HeightmapSettings{.side = 0}, HeightmapSettings{.side = 2},
          HeightmapSettings{.side = 128}, HeightmapSettings{.side = -1},
          HeightmapSettings{.side = 1'000'000'001}, HeightmapSettings{.level = -1},
          HeightmapSettings{.level = 4}, HeightmapSettings{.centre_x = kNan},
          HeightmapSettings{.centre_y = 1e300}, HeightmapSettings{.absent_height = kNan}}) {
        const Result<Heightmap> refused = make_heightmap(source, settings);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(refused.error().message.find(", got "), std::string::npos);
    }
}

}  // namespace heightmap_test
}  // namespace terrane::adapters
