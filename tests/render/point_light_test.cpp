// SPDX-License-Identifier: MIT
#include "render/render_scene.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/primitive_meshes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace terrane {
namespace point_light_test {

using test::is_same;
using test::pixel;
using test::Scene;

constexpr int kWidth = 240, kHeight = 160;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class PointLightTest : public test::PictureTest<kWidth, kHeight> {
protected:
    // Snow without haze, when the sun is below the horizon.
    static RendererSettings night() {
        RendererSettings settings;
        settings.sun_direction = {0.0, 0.0, -1.0};
        settings.haze_distance = kInfinity;
        settings.tint_low = -1000.0;
        settings.tint_high = -999.0;
        settings.sample_count = 1;
        return settings;
    }
    // Straight down on a point, 1 m per pixel, from so far away that the ground has no bumps.
    static View above(const WorldPos& p_world) {
        constexpr double kField = 0.04;
        const double height = kHeight / (2.0 * std::tan(0.5 * kField));
        return view_from(p_world + WorldPos(0.0, 0.0, height), p_world, kField);
    }
};

// display() of haze.glsl, and its inverse by bisection.
double shown(double light) {
    const double root = std::sqrt(light / (light + 0.80));
    return root + 0.6 * (root * root * (3.0 - 2.0 * root) - root);
}
double light_of(int level) {
    double low = 0.0, high = 100.0;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (255.0 * shown(middle) < level ? low : high) = middle;
    }
    return low;
}

TEST_F(PointLightTest, LevelGroundHasTheLightOfTheFormula) {
    // kSkyLight of haze.glsl, the light of white level ground at night
    constexpr std::array<double, 3> kSky{0.26, 0.35, 0.52};
    for (const std::int32_t roots_east : {0, 1 << 20}) {
        SCOPED_TRACE(roots_east);
        const Scene scene = test::make_plane_scene(0.0, 0.0, 2.0, roots_east);
        const WorldPos middle(256.0 * (roots_east + 1), 128.0, 0.0);
        TerrainRenderer renderer = make(night());
        const Image dark = test::draw(renderer, scene.mesh(), above(middle));
        const std::vector<PointLight> lights = {
            {.position_world = middle + WorldPos(-30.0, 4.0, 12.0),
             .intensity = {120.0, 80.0, 40.0},
             .range = 60.0},
            {.position_world = middle + WorldPos(25.0, -9.0, 20.0),
             .intensity = {0.0, 100.0, 300.0},
             .range = 50.0}};
        ASSERT_TRUE(renderer.set_point_lights(lights));
        const Image lit = test::draw(renderer, scene.mesh(), above(middle));
        int compared = 0, beyond = 0;
        for (int y = 4; y < kHeight; y += 3) {
            for (int x = 4; x < kWidth; x += 3) {
                const WorldPos p =
                    middle + WorldPos(x + 0.5 - 0.5 * kWidth, 0.5 * kHeight - y - 0.5, 0.0);
                std::array<double, 3> sum{};
                for (const PointLight& light : lights) {
                    const Eigen::Vector3d towards = light.position_world - p;
                    const double distance = towards.norm();
                    const double share = std::pow(distance / light.range, 4.0);
                    if (share >= 1.0) continue;
                    const double falloff = (1.0 - share) * (1.0 - share) / (distance * distance);
                    for (std::size_t c = 0; c < 3; ++c) {
                        sum[c] +=
                            light.intensity[static_cast<int>(c)] * falloff * towards.z() / distance;
                    }
                }
                if (sum == std::array<double, 3>{}) {
                    EXPECT_TRUE(is_same(dark, lit, x, y)) << x << ", " << y;
                    ++beyond;
                }
                for (std::size_t c = 0; c < 3; ++c) {
                    const double before = light_of(pixel(dark, x, y)[c]);
                    const double wanted = 255.0 * shown(before * (1.0 + sum[c] / kSky[c]));
                    EXPECT_NEAR(pixel(lit, x, y)[c], wanted, 2.5) << x << ", " << y;
                    ++compared;
                }
            }
        }
        EXPECT_GT(compared, 10000);
        EXPECT_GT(beyond, 500);
    }
}

TEST_F(PointLightTest, WithoutLightsPicturesAreWhatTheyWere) {
    const Scene scene = test::make_scene();
    const View view = view_from({100.0, -150.0, 120.0}, {256.0, 128.0, 0.0});
    RendererSettings full;
    full.atmosphere = true;
    full.ground_look = GroundLookSettings();
    full.water_level = 0.0;
    full.shadow_distance = 300.0;
    full.sample_count = 1;
    for (const RendererSettings& settings : {RendererSettings(), full}) {
        TerrainRenderer renderer = make(settings);
        const Image before = test::draw(renderer, scene.mesh(), view);
        ASSERT_TRUE(renderer.set_point_lights({}));
        EXPECT_EQ(test::draw(renderer, scene.mesh(), view).rgb, before.rgb);
        const PointLight light{.position_world = {220.0, 60.0, scene.height(220.0, 60.0) + 8.0},
                               .intensity = {500.0, 500.0, 500.0}};
        ASSERT_TRUE(renderer.set_point_lights(std::span(&light, 1)));
        const Image lit = test::draw(renderer, scene.mesh(), view);
        EXPECT_GT(test::count_different(lit, before, 4), 200);
        for (std::size_t i = 0; i < lit.rgb.size(); ++i) ASSERT_GE(lit.rgb[i] + 1, before.rgb[i]);
        ASSERT_TRUE(renderer.set_point_lights({}));
        EXPECT_EQ(test::draw(renderer, scene.mesh(), view).rgb, before.rgb);
    }
}

TEST_F(PointLightTest, MeshesAndImpostorsOfAnySizeAreLit) {
    TerrainRenderer renderer = make(night());
    const MeshId mesh = renderer.add_mesh(make_box_mesh({1.0, 1.0, 1.0}).value()).value();
    const ImpostorId impostor = renderer.add_impostor(mesh).value();
    const View view = view_from({0.0, -12.0, 1.0}, {0.0, 0.0, 0.0});
    const View far_view = view_from({0.0, -60.0, 5.0}, {0.0, 0.0, 0.0});
    const PointLight light{.position_world = {0.0, -10.0, 2.0}, .intensity = {80.0, 80.0, 80.0}};
    std::vector<double> gains;
    for (const bool is_impostor : {false, true}) {
        for (const View& from : {view, far_view}) {
            const std::array<ObjectInstance, 1> instances{test::instance_at(from, {0, 0, 0})};
            const MeshDraw of_mesh{.mesh = mesh, .first_instance = 0, .instance_count = 1};
            const ImpostorDraw of_impostor{
                .impostor = impostor, .first_instance = 0, .instance_count = 1};
            SceneDraws draws;
            draws.instances = instances;
            if (is_impostor) {
                draws.impostors = std::span(&of_impostor, 1);
            } else {
                draws.meshes = std::span(&of_mesh, 1);
            }
            ASSERT_TRUE(renderer.set_point_lights({}));
            const Image dark = test::draw(renderer, from, draws);
            ASSERT_TRUE(renderer.set_point_lights(std::span(&light, 1)));
            const Image lit = test::draw(renderer, from, draws);
            const int x = kWidth / 2, y = kHeight / 2;
            EXPECT_GT(test::brightness(lit, x, y), test::brightness(dark, x, y) + 60)
                << is_impostor;
            EXPECT_TRUE(is_same(lit, dark, 2, 2)) << "the sky";
            gains.push_back(test::brightness(lit, x, y));
        }
    }
    // an impostor has the light of its mesh; that of a small one is as far as its middle
    EXPECT_NEAR(gains[2], gains[0], 40.0);
    EXPECT_NEAR(gains[3], gains[1], 40.0);
}

TEST_F(PointLightTest, RefusesTooManyAndWhatIsOutOfRange) {
    const Scene scene = test::make_scene();
    const View view = view_from({100.0, -150.0, 120.0}, {256.0, 128.0, 0.0});
    TerrainRenderer renderer = make();
    const PointLight good{.position_world = {220.0, 60.0, scene.height(220.0, 60.0) + 8.0}};
    ASSERT_TRUE(renderer.set_point_lights(std::vector<PointLight>(kMostPointLights, good)));
    const Image before = test::draw(renderer, scene.mesh(), view);
    const auto expect_refused = [&](const std::vector<PointLight>& lights,
                                    const std::string& text) {
        const Result<void> set = renderer.set_point_lights(lights);
        ASSERT_FALSE(set) << text;
        EXPECT_EQ(set.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(set.error().message.find(text), std::string::npos) << set.error().message;
        EXPECT_EQ(set.error().message.find('\n'), std::string::npos);
    };
    expect_refused(std::vector<PointLight>(kMostPointLights + 1, good), "got 9");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double wrong : {nan, kInfinity, -kInfinity, -1.0, 2e9}) {
        PointLight light = good;
        light.intensity.y() = wrong;
        expect_refused({good, light}, "point light 1 must have an intensity");
    }
    for (const double wrong : {nan, kInfinity, -2e12}) {
        PointLight light = good;
        light.position_world.x() = wrong;
        expect_refused({light}, "point light 0 must be within");
    }
    for (const double wrong : {nan, kInfinity, 0.0, -1.0, 2e6}) {
        PointLight light = good;
        light.range = wrong;
        expect_refused({light}, "range");
    }
    EXPECT_EQ(test::draw(renderer, scene.mesh(), view).rgb, before.rgb) << "the lights are kept";
    for (const double edge : {0.0, 1e9}) {
        PointLight light = good;
        light.intensity.setConstant(edge);
        light.position_world.setConstant(edge);
        light.range = 1e6;
        EXPECT_TRUE(renderer.set_point_lights(std::span(&light, 1)));
        test::draw(renderer, scene.mesh(), view);
    }
}

}  // namespace point_light_test
}  // namespace terrane
