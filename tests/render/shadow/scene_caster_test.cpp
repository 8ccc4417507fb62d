// SPDX-License-Identifier: MIT
#include "render/gl_test.h"
#include "render/plane_scene.h"
#include "support/meshes/objects.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>
#include <terrane/scene/scene_graph.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

namespace terrane {
namespace scene_caster_test {

constexpr int kWidth = 160, kHeight = 120, kWideWidth = 480;
constexpr double kFov = 0.3;
const WorldPos kObject(256.0, 128.0, 0.0);

// From above: 10 pixels a metre, whatever the width.
View view_down(double x, int width_px) {
    const double height = 12.0 / (2.0 * std::tan(0.5 * kFov));
    return *look_at({x, 128.0, height}, {x, 128.0, 0.0}, kFov, width_px, kHeight);
}

int brightness(const Image& image, int x, int y) {
    const auto at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(x));
    return image.rgb[at] + image.rgb[at + 1] + image.rgb[at + 2];
}

// Draws a tree in a plane, 20 m west of the middle of the picture, by a Scene.
class SceneCasterTest : public test::GlTest {
protected:
    struct Drawn {
        Image image;
        DrawCounts counts;
        std::size_t casters = 0;
    };
    Drawn draw(const View& view, double shadow_distance, bool gives_casters, bool is_impostor) {
        RendererSettings settings;
        // from the west: the shadow of the tree of 8 m reaches 24 m
        settings.sun_direction = {-3.0, 0.0, 1.0};
        settings.haze_distance = std::numeric_limits<double>::infinity();
        settings.shadow_distance = shadow_distance;
        settings.shadow_texels = 4096;
        settings.sample_count = 1;
        TerrainRenderer renderer =
            TerrainRenderer::create(*context_, view.width_px, kHeight, settings).value();
        const TriangleMesh tree = test::make_tree(16);
        ObjectModel model;
        model.mesh = renderer.add_mesh(tree).value();
        model.bounds = bounding_box(tree.positions);
        model.levels = {
            {.error_m = 0.0, .triangles = static_cast<std::uint32_t>(tree.triangles.size())}};
        if (is_impostor) {
            model.impostor = renderer.add_impostor(model.mesh, {.views_above = 5}).value();
            model.levels = {{.error_m = 0.0, .triangles = 2, .is_impostor = true}};
        }
        model.absence_error_m = std::numeric_limits<double>::infinity();
        Scene scene = Scene::create({}).value();
        const PlacedObject object{.position_world = kObject};
        EXPECT_TRUE(scene.add_group(scene.add_model(model).value(), {&object, 1}));
        scene.begin_frame(view, 0.0, gives_casters ? renderer.shadows() : std::nullopt);
        const SceneDraws draws = scene.end_frame(1.0);
        const Result<void> drawn = renderer.draw(plane_.mesh(), view, {}, draws);
        EXPECT_TRUE(drawn) << drawn.error().message;
        return {renderer.read(), renderer.counts(), scene.counts().casters};
    }

    const test::Scene plane_ = test::make_plane_scene();
};

TEST_F(SceneCasterTest, AnObjectOutOfViewDarkensThePictureAsWhereAWiderViewSeesIt) {
    const double x = kObject.x() + 20.0;
    for (const bool is_impostor : {false, true}) {
        SCOPED_TRACE(is_impostor);
        const Drawn narrow = draw(view_down(x, kWidth), 200.0, true, is_impostor);
        const Drawn missing = draw(view_down(x, kWidth), 200.0, false, is_impostor);
        const Drawn bright = draw(view_down(x, kWidth), 0.0, true, is_impostor);
        const Drawn wide = draw(view_down(x, kWideWidth), 200.0, true, is_impostor);
        EXPECT_EQ(narrow.casters, 1u);
        EXPECT_EQ(narrow.counts.objects_drawn, 0u);
        EXPECT_EQ(narrow.counts.triangles, 0u);
        EXPECT_EQ(wide.casters, 0u);
        EXPECT_EQ(wide.counts.objects_drawn, 1u);
        EXPECT_EQ(test::largest_difference(missing.image, bright.image), 0)
            << "without its caster the picture has no shadow";
        EXPECT_EQ(bright.casters, 0u) << "a renderer without shadows asks for no casters";
        // The maps of the two views have texels of different sizes: pixels at the shadow's outline differ.
        int dark = 0, differing = 0;
        for (int y = 0; y < kHeight; ++y) {
            for (int column = 0; column < kWidth; ++column) {
                const int there = brightness(wide.image, column + (kWideWidth - kWidth) / 2, y);
                const int here = brightness(narrow.image, column, y);
                dark += 3 * here < 2 * brightness(bright.image, column, y) ? 1 : 0;
                differing += std::abs(here - there) > 30 ? 1 : 0;
            }
        }
        EXPECT_GT(dark, 500);
        EXPECT_LT(differing, dark / 10);
    }
}

TEST_F(SceneCasterTest, ANodeOutOfViewCastsItsShadowToo) {
    RendererSettings settings;
    settings.sun_direction = {-3.0, 0.0, 1.0};
    settings.shadow_distance = 200.0;
    settings.shadow_texels = 4096;
    settings.sample_count = 1;
    TerrainRenderer renderer =
        TerrainRenderer::create(*context_, kWidth, kHeight, settings).value();
    const TriangleMesh tree = test::make_tree(16);
    const GeometryNode node{.mesh = renderer.add_mesh(tree).value(),
                            .bounds = bounding_box(tree.positions)};
    SceneGraph graph;
    ASSERT_TRUE(graph.add(graph.root(), {.parent_from_node = {.translation = kObject}}, node));
    const View view = view_down(kObject.x() + 20.0, kWidth);
    Image images[2];
    for (const bool gives_casters : {false, true}) {
        const SceneDraws draws =
            graph.collect(view, 1.0, gives_casters ? renderer.shadows() : std::nullopt);
        ASSERT_TRUE(renderer.draw(plane_.mesh(), view, {}, draws));
        EXPECT_EQ(renderer.counts().objects_drawn, 0u);
        images[gives_casters ? 1 : 0] = renderer.read();
    }
    EXPECT_GT(test::count_different(images[0], images[1], 30), 300);
}

TEST_F(SceneCasterTest, CastersThatDoNotExistAreRefusedWhereThereAreShadows) {
    const View view = view_down(kObject.x(), kWidth);
    const MeshDraw no_mesh{.mesh = MeshId{7}, .instance_count = 0};
    const ImpostorDraw no_impostor{.impostor = ImpostorId{8}, .instance_count = 0};
    for (const double distance : {0.0, 100.0}) {
        RendererSettings settings;
        settings.shadow_distance = distance;
        TerrainRenderer renderer =
            TerrainRenderer::create(*context_, kWidth, kHeight, settings).value();
        const Result<void> with_mesh =
            renderer.draw(plane_.mesh(), view, {}, {.caster_meshes = {&no_mesh, 1}});
        const Result<void> with_impostor =
            renderer.draw(plane_.mesh(), view, {}, {.caster_impostors = {&no_impostor, 1}});
        if (distance == 0.0) {
            EXPECT_TRUE(with_mesh && with_impostor) << "without shadows they are ignored";
            continue;
        }
        ASSERT_FALSE(with_mesh);
        EXPECT_NE(with_mesh.error().message.find("no mesh 7"), std::string::npos);
        ASSERT_FALSE(with_impostor);
        EXPECT_NE(with_impostor.error().message.find("no impostor 8"), std::string::npos);
    }
}

}  // namespace scene_caster_test
}  // namespace terrane
