// SPDX-License-Identifier: MIT
#include "render/gl_test.h"
#include "render/plane_scene.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace terrane {
namespace water_test {

using test::count_different;
using test::make_plane_scene;
using test::Scene;

constexpr int kWidth = 320, kHeight = 241;  // odd: a level view has a row on the horizon
constexpr int kMiddle = kHeight / 2;

class WaterTest : public test::GlTest {
protected:
    Image draw(std::optional<double> water_level, const TerrainMesh& mesh, const View& view,
               std::span<const DrawnObject> objects = {}) {
        RendererSettings settings;
        settings.water_level = water_level;
        settings.sample_count = 1;
        Result<TerrainRenderer> renderer =
            TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        EXPECT_TRUE(renderer) << (renderer ? "" : renderer.error().message);
        const Result<void> drawn = renderer->draw(mesh, view, objects);
        EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
        return renderer->read();
    }
};

// On x = 256, y = 128 from above: 0.1 m a pixel at z = 0.
View view_down() {
    const double height = 0.1 * kHeight / (2.0 * std::tan(0.15));
    return *look_at({256.0, 128.0, height}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight);
}

const std::uint8_t* pixel(const Image& image, int x, int y) {
    return &image.rgb[3 * static_cast<std::size_t>(y * image.width + x)];
}
bool is_same(const Image& a, const Image& b, int x, int y) {
    return std::equal(pixel(a, x, y), pixel(a, x, y) + 3, pixel(b, x, y));
}

TEST_F(WaterTest, ShowsOnlyWhereTheGroundIsLowerAndHidesItWithDepth) {
    // lower in the west
    const Scene scene = make_plane_scene(0.0, 0.6);
    const Image dry = draw(std::nullopt, scene.mesh(), view_down());
    const Image wet = draw(0.0, scene.mesh(), view_down());
    for (int y = 0; y < kHeight; y += 5) {
        for (int x = 0; x < kWidth; ++x) {
            // a margin of a pixel at the shore, and of half a metre of depth, below which pictures may be equal
            if (x >= kWidth / 2 + 1) {
                ASSERT_TRUE(is_same(dry, wet, x, y)) << x << ", " << y;
            }
            if (x < kWidth / 2 - 8) {
                ASSERT_FALSE(is_same(dry, wet, x, y)) << x << ", " << y;
            }
        }
        // red is absorbed first: 1, 4 and 9 m deep
        const int shallow = pixel(wet, kWidth / 2 - 16, y)[0],
                  deep = pixel(wet, kWidth / 2 - 64, y)[0],
                  deepest = pixel(wet, kWidth / 2 - 144, y)[0];
        ASSERT_GT(shallow, deep + 20) << y;
        ASSERT_GT(deep, deepest) << y;
        ASSERT_GT(pixel(wet, kWidth / 2 - 144, y)[2], deepest + 10) << y;
    }
}

TEST_F(WaterTest, BelowAllGroundLeavesThePicture) {
    const Scene scene = make_plane_scene(0.0, 0.1);
    DrawnObject box;
    box.world_from_object.translation = {256.0, 128.0, 1.0};
    EXPECT_EQ(count_different(draw(std::nullopt, scene.mesh(), view_down(), {&box, 1}),
                              draw(-100.0, scene.mesh(), view_down(), {&box, 1})),
              0);
}

TEST_F(WaterTest, CoversTheWetPartOfAnObjectAlone) {
    const Scene scene = make_plane_scene(-6.0);
    // a pole from 4 m below to 4 m above the water, seen level from 30 m: only it is in the middle column
    DrawnObject pole;
    pole.extents = {0.5, 0.5, 4.0};
    pole.world_from_object.translation = {256.0, 128.0, 0.0};
    const View view = *look_at({256.0, 98.0, 1.0}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight);
    const Image dry = draw(std::nullopt, scene.mesh(), view, {&pole, 1});
    const Image wet = draw(0.0, scene.mesh(), view, {&pole, 1});
    // the waterline of its front is in the middle row; a metre is 26 pixels
    const int x = kWidth / 2, middle = kHeight / 2;
    EXPECT_TRUE(is_same(dry, wet, x, middle - 90));
    EXPECT_TRUE(is_same(dry, wet, x, middle - 3));
    EXPECT_FALSE(is_same(dry, wet, x, middle + 6));
    EXPECT_FALSE(is_same(dry, wet, x, middle + 60));
}

TEST_F(WaterTest, GoesOnBeyondTheGroundToTheHorizon) {
    const View view = *look_at({0.0, 0.0, 50.0}, {0.0, 100.0, 50.0}, 1.0, kWidth, kHeight);
    const Image sky = draw(std::nullopt, {}, view);
    const Image sea = draw(0.0, {}, view);
    for (int x = 0; x < kWidth; x += 16) {
        for (int y = 0; y < kHeight / 2 - 1; ++y) ASSERT_TRUE(is_same(sky, sea, x, y)) << x << y;
        // towards the horizon it reflects the sky there
        ASSERT_NEAR(pixel(sea, x, kMiddle + 1)[1], pixel(sky, x, kMiddle - 2)[1], 16);
        for (int channel = 0; channel < 3; ++channel)
            ASSERT_NEAR(pixel(sea, x, kMiddle)[channel], pixel(sky, x, kMiddle - 2)[channel], 16);
        ASSERT_LT(pixel(sea, x, kHeight - 1)[1], pixel(sky, x, kHeight / 2)[1] - 50);
    }
}

TEST_F(WaterTest, AnEyeUnderWaterSeesNearGroundAndThenWaterAlone) {
    const Scene scene = make_plane_scene(-6.0);
    const View view = *look_at({256.0, 20.0, -4.0}, {256.0, 120.0, -5.0}, 1.0, kWidth, kHeight);
    const Image dry = draw(std::nullopt, scene.mesh(), view);
    const Image wet = draw(0.0, scene.mesh(), view);
    EXPECT_GT(count_different(dry, wet, 4), kWidth * kHeight * 9 / 10);
    // far ground and the water over it have one colour
    for (int x = 0; x < kWidth; x += 16) {
        for (int channel = 0; channel < 3; ++channel)
            ASSERT_NEAR(pixel(wet, x, kMiddle)[channel], pixel(wet, x, kMiddle - 6)[channel], 2);
        ASSERT_GT(pixel(wet, x, kHeight - 1)[1], pixel(wet, x, kHeight / 2)[1] + 20);
    }
}

TEST_F(WaterTest, RefusesALevelThatIsNotFiniteOrTooFar) {
    for (const double level :
         {std::nan(""), std::numeric_limits<double>::infinity(), 1e300, -2e9}) {
        RendererSettings settings;
        settings.water_level = level;
        const auto made = TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find("water_level"), std::string::npos);
    }
}

}  // namespace water_test
}  // namespace terrane
