// SPDX-License-Identifier: MIT
#include "render/render_scene.h"
#include "terrain/ground_draws.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace terrane {
namespace terrain_renderer_test {

using test::count_different;
using test::draw;
using test::largest_difference;
using test::make_scene;
using test::pixel;
using test::Scene;

constexpr int kWidth = 320;
constexpr int kHeight = 180;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class TerrainRendererTest : public test::PictureTest<kWidth, kHeight> {};

View view_from(const WorldPos& eye, const WorldPos& target) {
    return *look_at(eye, target, 1.0, kWidth, kHeight);
}

// Straight down on the centre of the world: only ground in view.
View view_down() { return view_from({250.0, 130.0, 150.0}, {250.0, 130.0, 0.0}); }
// Horizontally over the hills: the horizon is in the middle.
View view_along() { return view_from({250.0, 20.0, 40.0}, {250.0, 140.0, 40.0}); }

TEST_F(TerrainRendererTest, RefusesSizesThatCannotBeAndNamesThem) {
    for (const auto& [width, height] :
         {std::pair{0, 10}, std::pair{10, 0}, std::pair{-4, 10}, std::pair{1'000'000, 10},
          std::pair{10, 2'000'000'000}, std::pair{16'000, 16'000}}) {
        const Result<TerrainRenderer> made = TerrainRenderer::create(*context_, width, height, {});
        ASSERT_FALSE(made) << width << " x " << height;
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find(std::to_string(width) + " x " + std::to_string(height)),
                  std::string::npos)
            << made.error().message;
    }
}

TEST_F(TerrainRendererTest, RefusesSettingsOutOfRangeAndNamesThem) {
    const auto refused = [&](const RendererSettings& settings, const std::string& text) {
        const Result<TerrainRenderer> made =
            TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        ASSERT_FALSE(made) << text;
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find(text), std::string::npos) << made.error().message;
    };
    const double nan = std::nan("");
    for (const double distance : {0.0, nan}) refused({.haze_distance = distance}, "");
    refused({.sun_direction = Eigen::Vector3d::Zero()}, "");
    refused({.sun_direction = {nan, 0.4, 0.77}}, "");
    refused({.tint_low = 0.0, .tint_high = 0.0}, "");
    refused({.tint_low = -kInfinity}, "");
    refused({.sample_count = 0}, "");
    refused({.horizon_colour = {0.7f, 128.0f, 0.9f}},
            "horizon_colour must have parts from 0 to 1, got 128");
    refused({.zenith_colour = {-0.1f, 0.0f, 0.0f}}, "zenith_colour");
    for (const double level : {nan, kInfinity, 1e300, -2e9})
        refused({.water_level = level}, "water_level");
    for (const double distance : {-1.0, 1.1e6, 1e300, nan, kInfinity})
        refused({.shadow_distance = distance}, "shadow_distance");
    for (const double radius : {-0.001, 0.06, nan, kInfinity})
        refused({.sun_radius = radius}, "sun_radius");
    for (const double stops : {-21.0, 20.5, nan, kInfinity})
        refused({.exposure_stops = stops}, "exposure_stops");
    for (const int texels : {0, 255, 8193}) {
        refused({.shadow_texels = texels}, "shadow_texels");
        refused({.shadow_texels = texels}, std::to_string(texels));
    }
}

TEST_F(TerrainRendererTest, ABadViewOrMeshIsRefusedAndTheLastFrameStays) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image before = draw(renderer, scene.mesh(), view_along());

    std::vector<View> views(3, view_along());
    views[0].eye_world.x() = std::nan("");
    views[1].width_px = 2 * kWidth;
    views[2].eye_world.z() = 1e300;
    for (const View& view : views) {
        const Result<void> drawn = renderer.draw(scene.mesh(), view);
        ASSERT_FALSE(drawn);
        EXPECT_EQ(drawn.error().code, ErrorCode::invalid_argument);
    }
    TerrainMesh torn = scene.mesh();
    torn.indices = torn.indices.first(30);
    TerrainMesh homeless = scene.mesh();
    homeless.resident = nullptr;
    const Scene other = make_scene();
    TerrainMesh foreign = scene.mesh();
    foreign.resident = other.resident;
    for (const TerrainMesh& mesh : {torn, homeless, foreign}) {
        const Result<void> drawn = renderer.draw(mesh, view_down());
        ASSERT_FALSE(drawn);
        EXPECT_EQ(drawn.error().code, ErrorCode::invalid_argument);
    }
    EXPECT_EQ(count_different(before, renderer.read()), 0);
}

TEST_F(TerrainRendererTest, AMeshWithoutTrianglesIsSkyThatGetsDeeperUpwards) {
    TerrainRenderer renderer = make();
    const Image image = draw(renderer, TerrainMesh{}, view_along());
    // red fades towards the zenith
    EXPECT_GT(pixel(image, 10, kHeight / 2)[0], pixel(image, 10, 0)[0] + 20);
    // sky: each row is bluer than red
    for (int y = 0; y < kHeight / 2; ++y) {
        ASSERT_GT(pixel(image, 10, y)[2], pixel(image, 10, y)[0]) << y;
    }
}

TEST_F(TerrainRendererTest, TheHorizonSeparatesSkyAndGround) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image sky = draw(renderer, TerrainMesh{}, view_along());
    const Image both = draw(renderer, scene.mesh(), view_along());
    for (int x = 0; x < kWidth; x += 8) {
        for (int y = 0; y < kHeight / 2 - 2; ++y) {
            // hills are 12 m high at most, the eye is at 40 m
            ASSERT_TRUE(test::is_same(sky, both, x, y)) << x << ", " << y;
        }
        ASSERT_FALSE(test::is_same(sky, both, x, kHeight - 1)) << x;
    }
}

// Counts pixels of the ground that depend on the colour of the sky behind it: cracks.
class CrackTest : public TerrainRendererTest {
protected:
    void SetUp() override {
        TerrainRendererTest::SetUp();
        if (!context_) return;
        for (const Colour& colour : {Colour{1.0f, 0.0f, 1.0f}, Colour{0.0f, 1.0f, 0.0f}}) {
            renderers_.push_back(make(
                {.haze_distance = kInfinity, .horizon_colour = colour, .zenith_colour = colour}));
        }
    }

    int count_sky_pixels(const TerrainMesh& mesh, const View& view) {
        const Image purple = draw(renderers_[0], mesh, view);
        // one of four samples of sky gives a difference of 255 / 4; rounding of the haze gives 1
        return count_different(purple, draw(renderers_[1], mesh, view), 8);
    }

    std::vector<TerrainRenderer> renderers_;
};

TEST_F(CrackTest, NoSkyShowsThroughClosedGroundWhereLevelsMeet) {
    const Scene scene = make_scene();
    EXPECT_EQ(count_sky_pixels(scene.mesh(), view_down()), 0);
    // around two corners of the fine chunk, from many positions, without the edge of the world in view
    for (int i = 0; i < 24; ++i) {
        const double turn = 0.26 * i;
        const double x = i % 2 == 0 ? 128.0 : 256.0;
        const WorldPos eye(x + 15.3 * std::cos(turn), 128.0 + 13.7 * std::sin(turn),
                           40.0 + 1.3 * i);
        const WorldPos target(x + 9.0 * std::sin(2.0 * turn), 128.0, 0.0);
        EXPECT_EQ(count_sky_pixels(scene.mesh(), view_from(eye, target)), 0) << "view " << i;
    }
}

TEST_F(CrackTest, NoSkyShowsThroughGroundThatMorphsWhereLevelsMeet) {
    // the second is 10,000 km from the origin
    for (const std::int32_t roots_east : {0, 39'063}) {
        Scene scene = make_scene(roots_east);
        test::add_offsets(scene);
        const double west = 256.0 * roots_east;
        for (int i = 0; i < 12; ++i) {
            const double turn = 0.52 * i;
            const WorldPos eye(west + 128.0 + 15.3 * std::cos(turn), 128.0 + 13.7 * std::sin(turn),
                               40.0 + 2.6 * i);
            const WorldPos target(west + 128.0 + 9.0 * std::sin(2.0 * turn), 128.0, 0.0);
            EXPECT_EQ(count_sky_pixels(scene.mesh(), view_from(eye, target)), 0) << "view " << i;
        }
    }
}

TEST_F(CrackTest, AnOffsetThatOneChunkLacksTearsTheGround) {
    Scene scene = make_scene();
    test::add_offsets(scene);
    // the southern edge of the fine chunk; the root beside it keeps its offsets
    for (int column = 0; column <= kChunkCells; column += 2) {
        scene.offsets[1][sample_index(column, 0)] -= 4.0f;
    }
    const double z = scene.height(180.0, 128.0);
    const View view = view_from({180.0, 140.0, z + 4.0}, {180.0, 128.0, z - 2.0});
    EXPECT_GT(count_sky_pixels(scene.mesh(), view), 0);
}

TEST_F(TerrainRendererTest, OffsetsMoveTheGroundAndZerosLeaveEveryPixel) {
    Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image still = draw(renderer, scene.mesh(), view_along());
    test::add_offsets(scene);
    EXPECT_GT(count_different(still, draw(renderer, scene.mesh(), view_along())), 1000);
    for (std::vector<float>& offsets : scene.offsets) {
        for (float& offset : offsets) offset = 0.0f;
    }
    EXPECT_EQ(count_different(still, draw(renderer, scene.mesh(), view_along())), 0);
    for (MeshChunk& chunk : scene.chunks) chunk.offsets = nullptr;
    EXPECT_EQ(count_different(still, draw(renderer, scene.mesh(), view_along())), 0);
}

TEST_F(CrackTest, OneMissingTriangleIsSeen) {
    Scene scene = make_scene();
    // a triangle of the fine chunk near its corner, in the middle of the view
    scene.chunks[2].first_index += 3;
    scene.chunks[2].index_count -= 3;
    const View view = view_from({129.0, 129.0, 60.0}, {129.0, 129.0, 0.0});
    EXPECT_GT(count_sky_pixels(scene.mesh(), view), 0);
}

TEST_F(TerrainRendererTest, APictureTenThousandKilometresAwayIsTheSamePicture) {
    const std::int32_t far_roots = 39'063;
    const double east = 256.0 * far_roots;
    ASSERT_GT(east, 1e7);
    const Scene near = make_scene();
    const Scene far = make_scene(far_roots);
    for (View view : {view_down(), view_along()}) {
        TerrainRenderer renderer = make();
        const Image here = draw(renderer, near.mesh(), view);
        view.eye_world.x() += east;
        const Image there = draw(renderer, far.mesh(), view);
        EXPECT_EQ(count_different(here, there), 0);
    }
}

TEST_F(TerrainRendererTest, AnEyeThatCreepsFarFromTheOriginMovesThePictureSmoothly) {
    const std::int32_t far_roots = 39'063;
    const Scene scene = make_scene(far_roots);
    TerrainRenderer renderer = make();
    const double x = 256.0 * far_roots + 100.25;
    const double z = scene.height(x, 100.0) + 2.0;
    // float has a resolution of metres there: a renderer that rounds world positions would move in jumps
    Image last;
    int changed = 0;
    for (int step = 0; step < 12; ++step) {
        const double creep = 0.0008 * step;
        const Image image = draw(renderer, scene.mesh(),
                                 view_from({x + creep, 100.0, z}, {x + creep, 130.0, z - 8.0}));
        if (step > 0) {
            EXPECT_LE(largest_difference(last, image), 40) << "step " << step;
            changed += count_different(last, image) > 0 ? 1 : 0;
        }
        last = image;
    }
    EXPECT_GE(changed, 10);
}

TEST_F(TerrainRendererTest, GroundIsSeenFromBelowAndItsFrontsHideItsBacksFromAbove) {
    const test::Scene scene = make_scene();
    EXPECT_TRUE(internal::is_above_ground(scene.mesh(), {100.0, 100.0, 40.0}));
    EXPECT_FALSE(internal::is_above_ground(scene.mesh(), {100.0, 100.0, -40.0}));
    EXPECT_FALSE(internal::is_above_ground(scene.mesh(), {-1.0, 100.0, 40.0}));
    for (const double x : {5.0, 130.0, 200.0, 300.0}) {
        const double height = scene.height(x, 70.0);
        EXPECT_TRUE(internal::is_above_ground(scene.mesh(), {x, 70.0, height + 4.0}));
        EXPECT_FALSE(internal::is_above_ground(scene.mesh(), {x, 70.0, height - 0.1}));
    }
    TerrainRenderer renderer = make();
    const View up = view_from({100.0, 100.0, -60.0}, {110.0, 110.0, 0.0});
    const Image sky = draw(renderer, TerrainMesh{}, up);
    EXPECT_GT(count_different(draw(renderer, scene.mesh(), up), sky),
              sky.width * sky.height * 9 / 10);
}

TEST_F(TerrainRendererTest, WireframeDrawsLinesOverTheSameGround) {
    const Scene scene = make_scene();
    TerrainRenderer plain = make();
    const Image ground = draw(plain, scene.mesh(), view_down());
    TerrainRenderer lined = make({.wireframe = true});
    const Image lines = draw(lined, scene.mesh(), view_down());
    const int different = count_different(ground, lines);
    EXPECT_GT(different, kWidth * kHeight / 50);
    // the next frame fills the triangles again
    EXPECT_EQ(count_different(lines, draw(lined, scene.mesh(), view_down())), 0);
}

TEST_F(TerrainRendererTest, AMovedSunAndAnotherSizeGiveThePicturesOfARendererMadeSo) {
    const Scene scene = make_scene();
    const Eigen::Vector3d evening(1.0, -0.3, 0.4);
    for (const bool has_air : {false, true}) {
        RendererSettings settings{.shadow_distance = 500.0, .atmosphere = has_air};
        TerrainRenderer renderer = make(settings);
        const Image day = draw(renderer, scene.mesh(), view_along());
        ASSERT_TRUE(renderer.set_sun(evening));
        const Image moved = draw(renderer, scene.mesh(), view_along());
        settings.sun_direction = evening;
        TerrainRenderer of_evening = make(settings);
        EXPECT_GT(count_different(day, moved), 1000);
        EXPECT_EQ(count_different(draw(of_evening, scene.mesh(), view_along()), moved), 0);
        EXPECT_EQ(renderer.shadows()->sun_direction, evening);
        ASSERT_FALSE(renderer.set_sun(Eigen::Vector3d::Zero()));
        EXPECT_EQ(count_different(draw(renderer, scene.mesh(), view_along()), moved), 0);

        View wide = view_along();
        wide.width_px = 2 * kWidth;
        wide.height_px = kHeight / 2;
        ASSERT_TRUE(renderer.resize(wide.width_px, wide.height_px));
        ASSERT_FALSE(renderer.resize(0, kHeight));
        ASSERT_FALSE(renderer.draw(scene.mesh(), view_along()));
        const Image resized = draw(renderer, scene.mesh(), wide);
        TerrainRenderer of_size =
            TerrainRenderer::create(*context_, wide.width_px, wide.height_px, settings).value();
        EXPECT_EQ(count_different(draw(of_size, scene.mesh(), wide), resized), 0);
    }
}

TEST_F(TerrainRendererTest, MarksCoverTheTrianglesOfTheirChunksAlone) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image plain = draw(renderer, scene.mesh(), view_down());
    const Chunk* const marked = scene.mesh().chunks.front().chunk;
    renderer.set_ground_marks([marked](const MeshChunk& chunk) {
        return GroundMark{{1.0f, 0.0f, 0.5f}, chunk.chunk == marked ? 1.0f : 0.0f};
    });
    const Image with_mark = draw(renderer, scene.mesh(), view_down());
    std::ptrdiff_t covered = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if (test::is_same(plain, with_mark, x, y)) continue;
            // pixels at the chunk's border are covered in part
            const std::uint8_t* const rgb = pixel(with_mark, x, y);
            if (rgb[0] == 255 && rgb[1] == 0) ++covered;
        }
    }
    const std::ptrdiff_t changed = count_different(plain, with_mark);
    EXPECT_GT(covered, kWidth * kHeight / 10);
    EXPECT_LT(changed, kWidth * kHeight * 9 / 10);
    EXPECT_GT(covered, changed * 9 / 10);
    renderer.set_ground_marks(nullptr);
    EXPECT_EQ(count_different(draw(renderer, scene.mesh(), view_down()), plain), 0);
    renderer.set_wireframe(true);
    EXPECT_GT(count_different(draw(renderer, scene.mesh(), view_down()), plain), 1000);
    renderer.set_wireframe(false);
    EXPECT_EQ(count_different(draw(renderer, scene.mesh(), view_down()), plain), 0);
}

TEST_F(TerrainRendererTest, ObjectsCoverWhatLiesBehindAndHideBehindHills) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image ground = draw(renderer, scene.mesh(), view_down());
    using Form = test::Solid::Form;
    // 12 m at 114 to 126 m are about 16 pixels: a square, a disc, and a lying cylinder
    for (const auto& [form, least, most] :
         {std::tuple(Form::box, 200, 400), std::tuple(Form::ellipsoid, 150, 300),
          std::tuple(Form::cylinder, 200, 400)}) {
        SCOPED_TRACE(static_cast<int>(form));
        test::Solid object;
        object.form = form;
        object.extents = {6.0, 6.0, 6.0};
        object.world_from_solid.translation = {240.0, 130.0, 30.0};
        if (form == Form::cylinder) {
            object.world_from_solid.rotation << 0, 0, 1, 1, 0, 0, 0, 1, 0;
        }
        const int covered =
            count_different(ground, draw(renderer, scene.mesh(), view_down(), {&object, 1}));
        EXPECT_GT(covered, least);
        EXPECT_LT(covered, most);

        object.world_from_solid.translation.z() = -60.0;
        EXPECT_EQ(count_different(ground, draw(renderer, scene.mesh(), view_down(), {&object, 1})),
                  0);
    }
}

TEST_F(TerrainRendererTest, KeepsBuffersWhileChunksAreResidentAndDropsThemAfterwards) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
    const Image first = draw(renderer, scene.mesh(), view_down());
    const std::size_t bytes = renderer.buffer_bytes();
    EXPECT_GT(bytes, 3u * kChunkSamples * kChunkSamples * sizeof(std::int32_t));
    EXPECT_EQ(count_different(first, draw(renderer, scene.mesh(), view_down())), 0);
    EXPECT_EQ(renderer.buffer_bytes(), bytes);

    // the fine chunk leaves
    TerrainMesh coarse;
    coarse.resident = std::make_shared<const ResidentSet>(
        scene.resident->lattice(), scene.resident->extent(),
        std::vector<std::shared_ptr<const Chunk>>(scene.resident->chunks().begin(),
                                                  scene.resident->chunks().begin() + 2),
        2);
    draw(renderer, coarse, view_down());
    EXPECT_EQ(renderer.buffer_bytes(), bytes / 3 * 2);
}

TEST_F(TerrainRendererTest, AChunkThatWasLoadedAgainIsNotTakenForItsPredecessor) {
    Scene scene = make_scene();
    TerrainRenderer renderer = make();
    const Image before = draw(renderer, scene.mesh(), view_down());
    // the same keys, other heights
    std::vector<std::shared_ptr<const Chunk>> raised;
    for (const std::shared_ptr<const Chunk>& chunk : scene.resident->chunks()) {
        auto copy = std::make_shared<Chunk>(*chunk);
        for (std::int32_t& height : copy->heights) height = -height;
        raised.push_back(copy);
    }
    scene.resident = std::make_shared<const ResidentSet>(scene.resident->lattice(),
                                                         scene.resident->extent(), raised, 2);
    for (MeshChunk& chunk : scene.chunks)
        chunk.chunk = scene.resident->find_chunk(chunk.chunk->key);
    TerrainRenderer fresh = make();
    const Image wanted = draw(fresh, scene.mesh(), view_down());
    EXPECT_GT(count_different(before, wanted), 1000);
    EXPECT_EQ(count_different(wanted, draw(renderer, scene.mesh(), view_down())), 0);
}

TEST_F(TerrainRendererTest, OutlivesItsContextObject) {
    const Scene scene = make_scene();
    TerrainRenderer renderer = make();
    context_.reset();
    draw(renderer, scene.mesh(), view_down());
}

}  // namespace terrain_renderer_test

namespace water_test {

using test::count_different;
using test::is_same;
using test::make_plane_scene;
using test::pixel;
using test::Scene;

constexpr int kWidth = 320, kHeight = 241;  // odd: a level view has a row on the horizon
constexpr int kMiddle = kHeight / 2;

class WaterTest : public test::PictureTest<kWidth, kHeight> {
protected:
    Image draw(std::optional<double> water_level, const TerrainMesh& mesh, const View& view,
               std::span<const test::Solid> objects = {}) {
        TerrainRenderer renderer = make({.sample_count = 1, .water_level = water_level});
        return test::draw(renderer, mesh, view, objects);
    }
};

// On x = 256, y = 128 from above: 0.1 m a pixel at z = 0.
View view_down() {
    const double height = 0.1 * kHeight / (2.0 * std::tan(0.15));
    return *look_at({256.0, 128.0, height}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight);
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
    test::Solid box;
    box.world_from_solid.translation = {256.0, 128.0, 1.0};
    EXPECT_EQ(count_different(draw(std::nullopt, scene.mesh(), view_down(), {&box, 1}),
                              draw(-100.0, scene.mesh(), view_down(), {&box, 1})),
              0);
}

TEST_F(WaterTest, CoversTheWetPartOfAnObjectAlone) {
    const Scene scene = make_plane_scene(-6.0);
    // a pole from 4 m below to 4 m above the water, seen level from 30 m: only it is in the middle column
    test::Solid pole;
    pole.extents = {0.5, 0.5, 4.0};
    pole.world_from_solid.translation = {256.0, 128.0, 0.0};
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

}  // namespace water_test
}  // namespace terrane
