// SPDX-License-Identifier: MIT
#include "render/gl_test.h"
#include "render/plane_scene.h"
#include "support/meshes/objects.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane {
namespace shadow_test {

using test::largest_difference;
using test::make_plane_scene;
using test::Scene;

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFov = 0.3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

RendererSettings with_sun(const Eigen::Vector3d& sun, double shadow_distance) {
    RendererSettings settings;
    settings.sun_direction = sun;
    settings.haze_distance = kInfinity;
    settings.shadow_distance = shadow_distance;
    settings.sample_count = 1;
    return settings;
}

// From above, so that a pixel of the plane z = 0 is metres / kPixelsPerMetre.
constexpr double kPixelsPerMetre = 10.0;
View view_down(double x, double y) {
    const double height = kHeight / kPixelsPerMetre / (2.0 * std::tan(0.5 * kFov));
    return *look_at({x, y, height}, {x, y, 0.0}, kFov, kWidth, kHeight);
}

DrawnObject box_at(double x, double y, double half) {
    DrawnObject box;
    box.extents = Eigen::Vector3d::Constant(half);
    box.world_from_object.translation = {x, y, half};
    return box;
}

int brightness(const Image& image, int x, int y) {
    const auto at = 3 * (static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x));
    return image.rgb[at] + image.rgb[at + 1] + image.rgb[at + 2];
}

// Pixels that are darker in one picture than in the other by a third.
struct Darkened {
    int count = 0;
    int west = kWidth, east = -1, north = kHeight, south = -1;  // edges, inclusive
    double x = 0.0, y = 0.0;                                    // mean
};
Darkened darkened(const Image& image, const Image& than) {
    Darkened found;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if (3 * brightness(image, x, y) > 2 * brightness(than, x, y)) continue;
            ++found.count;
            found.west = std::min(found.west, x);
            found.east = std::max(found.east, x);
            found.north = std::min(found.north, y);
            found.south = std::max(found.south, y);
            found.x += x;
            found.y += y;
        }
    }
    found.x /= std::max(found.count, 1);
    found.y /= std::max(found.count, 1);
    return found;
}

class ShadowTest : public test::GlTest {
protected:
    Image draw(const RendererSettings& settings, const Scene& scene, const View& view,
               std::span<const DrawnObject> objects = {}) {
        Result<TerrainRenderer> renderer =
            TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        EXPECT_TRUE(renderer) << (renderer ? "" : renderer.error().message);
        const Result<void> drawn = renderer->draw(scene.mesh(), view, objects);
        EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
        return renderer->read();
    }
};

TEST_F(ShadowTest, ABoxCastsItsShadowWhereTheSunSaysItShould) {
    const Scene scene = make_plane_scene();
    const View view = view_down(260.0, 128.0);
    const DrawnObject box = box_at(256.0, 128.0, 2.0);
    // towards the sun: west, at two elevations; the shadow of the upper eastern edge is 4 m / tan of it away
    for (const double rise : {1.0, 0.5}) {
        SCOPED_TRACE(rise);
        const Eigen::Vector3d sun(-1.0, 0.0, rise);
        RendererSettings settings = with_sun(sun, 200.0);
        settings.shadow_texels = 2048;  // 1.5 pixels in the last cascade, which the plane is in
        const Image dark = draw(settings, scene, view, {&box, 1});
        const Image bright = draw(with_sun(sun, 0.0), scene, view, {&box, 1});
        const Darkened found = darkened(dark, bright);
        const auto column = [&](double x) { return 0.5 * kWidth + kPixelsPerMetre * (x - 260.0); };
        // the middle of a pixel is half a pixel from its edge
        EXPECT_NEAR(found.west + 0.5, column(258.0), 2.0);
        EXPECT_NEAR(found.east + 0.5, column(258.0 + 4.0 / rise), 2.0);
        EXPECT_NEAR(found.north + 0.5, 0.5 * kHeight - 20.0, 2.0);
        EXPECT_NEAR(found.south + 0.5, 0.5 * kHeight + 20.0, 2.0);
        EXPECT_NEAR(found.count, 4.0 / rise * 4.0 * 100.0, 250.0);
    }
}

TEST_F(ShadowTest, APlaneHasNoShadowOfItsOwnHoweverLowTheSun) {
    for (const double slope : {0.0, 0.7, -1.5}) {
        const Scene scene = make_plane_scene(0.0, slope);
        const Eigen::Vector3d normal = Eigen::Vector3d(-slope, 0.0, 1.0).normalized();
        for (int i = 0; i < 8; ++i) {
            // 3 to 73 degrees over the plane
            const double elevation = 0.05 + 0.175 * i, azimuth = 0.8 * i;
            const Eigen::Vector3d along = normal.cross(Eigen::Vector3d::UnitY());
            const Eigen::Vector3d sun =
                std::sin(elevation) * normal +
                std::cos(elevation) *
                    (std::cos(azimuth) * along + std::sin(azimuth) * Eigen::Vector3d::UnitY());
            // near and far: all cascades, and where they fade
            for (const double distance : {20.0, 100.0, 400.0}) {
                SCOPED_TRACE(testing::Message() << slope << " " << i << " " << distance);
                const WorldPos target(256.0, 128.0, 0.0);
                const Eigen::Vector3d from = (0.5 * normal - Eigen::Vector3d::UnitY()).normalized();
                const View view =
                    *look_at(target + 0.3 * distance * from, target, 1.0, kWidth, kHeight);
                EXPECT_LE(largest_difference(draw(with_sun(sun, distance), scene, view),
                                             draw(with_sun(sun, 0.0), scene, view)),
                          2);
            }
        }
    }
}

TEST_F(ShadowTest, ShadowsStayWhereTheyAreWhileTheEyeTurns) {
    const Scene scene = make_plane_scene();
    const DrawnObject box = box_at(256.0, 128.0, 2.0);
    const Eigen::Vector3d sun(-1.0, 0.3, 0.8);
    const View first = view_down(256.0, 128.0);
    // world coordinates on the plane z = 0 of the mean pixel
    const auto on_plane = [](const View& view, const Darkened& found) {
        const double scale = std::tan(0.5 * view.vertical_fov) / (0.5 * kHeight);
        const Eigen::Vector3d ray = view.forward +
                                    scale * (found.x + 0.5 - 0.5 * kWidth) * view.right() -
                                    scale * (found.y + 0.5 - 0.5 * kHeight) * view.up;
        return WorldPos(view.eye_world - ray * (view.eye_world.z() / ray.z()));
    };
    std::vector<WorldPos> places;
    std::vector<int> counts;
    for (int i = 0; i < 12; ++i) {
        const double turn = 0.003 * i;
        const View view =
            *look_at(first.eye_world, {256.0 + 80.0 * std::sin(turn), 128.0 - 60.0 * turn, 0.0},
                     kFov, kWidth, kHeight);
        const Darkened found = darkened(draw(with_sun(sun, 200.0), scene, view, {&box, 1}),
                                        draw(with_sun(sun, 0.0), scene, view, {&box, 1}));
        places.push_back(on_plane(view, found));
        counts.push_back(found.count);
    }
    for (std::size_t i = 1; i < places.size(); ++i) {
        // a fifth of a pixel
        EXPECT_LT((places[i] - places[0]).norm(), 0.2 / kPixelsPerMetre) << i;
        EXPECT_NEAR(counts[i], counts[0], 0.03 * counts[0]) << i;
    }
}

TEST_F(ShadowTest, GroundOutOfViewCastsShadows) {
    Scene scene = make_plane_scene();
    // a sheet 50 m over the west: with the sun at 45 degrees its shadow ends at x = 306
    test::raise_western_root(scene, 50.0f);
    const Eigen::Vector3d sun(-1.0, 0.0, 1.0);
    for (const double x : {285.0, 340.0}) {
        const View view = view_down(x, 128.0);
        const Image dark = draw(with_sun(sun, 300.0), scene, view);
        const Darkened found = darkened(dark, draw(with_sun(sun, 0.0), scene, view));
        EXPECT_EQ(found.count, x < 306.0 ? kWidth * kHeight : 0) << x;
    }
}

TEST_F(ShadowTest, FadesTowardsItsDistance) {
    const Scene scene = make_plane_scene();
    const Eigen::Vector3d sun(-1.0, 0.0, 1.0);
    const DrawnObject box = box_at(256.0, 128.0, 4.0);
    const View view = view_down(262.0, 128.0);  // from 79 m
    const Image bright = draw(with_sun(sun, 0.0), scene, view, {&box, 1});
    const Image dark = draw(with_sun(sun, 400.0), scene, view, {&box, 1});
    const Image faded = draw(with_sun(sun, 92.0), scene, view, {&box, 1});
    const Image none = draw(with_sun(sun, 70.0), scene, view, {&box, 1});
    const int x = kWidth / 2, y = kHeight / 2;
    EXPECT_LT(brightness(dark, x, y), brightness(faded, x, y) - 10);
    EXPECT_LT(brightness(faded, x, y), brightness(bright, x, y) - 10);
    EXPECT_LE(largest_difference(none, bright), 1);
}

TEST_F(ShadowTest, AnImpostorCastsAboutTheShadowOfItsMesh) {
    const Scene scene = make_plane_scene();
    const Eigen::Vector3d sun(-1.0, 0.2, 0.7);
    View view = view_down(262.0, 128.0);
    view.width_px = kWidth;
    std::vector<Darkened> found;
    for (const bool is_impostor : {false, true}) {
        std::vector<Image> images;
        for (const double distance : {300.0, 0.0}) {
            TerrainRenderer renderer =
                TerrainRenderer::create(*context_, kWidth, kHeight, with_sun(sun, distance))
                    .value();
            const MeshId mesh = renderer.add_mesh(test::make_tree(16)).value();
            const ImpostorId impostor = renderer.add_impostor(mesh, {.views_above = 5}).value();
            ObjectInstance instance;
            const LocalVec offset = to_local({256.0, 128.0, 0.0}, view.eye_world);
            instance.offset_eye = {offset.x(), offset.y(), offset.z()};
            const MeshDraw as_mesh{.mesh = mesh, .instance_count = 1};
            const ImpostorDraw as_impostor{.impostor = impostor, .instance_count = 1};
            SceneDraws draws{.instances = {&instance, 1}};
            if (is_impostor) {
                draws.impostors = {&as_impostor, 1};
            } else {
                draws.meshes = {&as_mesh, 1};
            }
            ASSERT_TRUE(renderer.draw(scene.mesh(), view, {}, draws));
            images.push_back(renderer.read());
        }
        found.push_back(darkened(images[0], images[1]));
    }
    EXPECT_GT(found[0].count, 300);
    EXPECT_NEAR(found[1].count, found[0].count, 0.25 * found[0].count);
    EXPECT_NEAR(found[1].x, found[0].x, 6.0);
    EXPECT_NEAR(found[1].y, found[0].y, 6.0);
}

TEST_F(ShadowTest, TakesMemoryOnlyWhereItIsAskedFor) {
    const RendererSettings off = with_sun({0.0, 0.0, 1.0}, 0.0);
    RendererSettings on = with_sun({0.0, 0.0, 1.0}, 100.0);
    on.shadow_texels = 512;
    const TerrainRenderer without =
        TerrainRenderer::create(*context_, kWidth, kHeight, off).value();
    const TerrainRenderer with = TerrainRenderer::create(*context_, kWidth, kHeight, on).value();
    EXPECT_EQ(without.buffer_bytes(), 0u);
    EXPECT_EQ(with.buffer_bytes(), 12u * 512u * 512u);
}

TEST_F(ShadowTest, RefusesSettingsOutOfRangeAndNamesThem) {
    for (const double distance : {-1.0, 1.1e6, 1e300, std::nan(""), kInfinity}) {
        const auto made = TerrainRenderer::create(*context_, kWidth, kHeight,
                                                  with_sun({0.0, 0.0, 1.0}, distance));
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find("shadow_distance"), std::string::npos);
    }
    for (const int texels : {0, 255, 8193}) {
        RendererSettings settings;
        settings.shadow_texels = texels;
        const auto made = TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find("shadow_texels"), std::string::npos);
        EXPECT_NE(made.error().message.find(std::to_string(texels)), std::string::npos);
    }
}

}  // namespace shadow_test
}  // namespace terrane
