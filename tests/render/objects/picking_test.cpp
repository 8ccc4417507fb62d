// SPDX-License-Identifier: MIT
// A ray through a pixel meets the object that the pixel shows.
#include "render/gl_test.h"
#include "support/meshes/objects.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

namespace terrane {
namespace picking_test {

constexpr int kWidth = 200, kHeight = 140;

class Picking : public test::GlTest {};

// Rocks of one colour on a sky: a pixel that differs from the sky shows a rock.
TEST_F(Picking, RaysThroughPixelsMeetTheObjectsThatTheyShow) {
    const RendererSettings settings = {.sample_count = 1};
    TerrainRenderer renderer =
        TerrainRenderer::create(*context_, kWidth, kHeight, settings).value();
    const TriangleMesh mesh = test::make_rock(2, 4);
    ObjectModel model;
    model.mesh = renderer.add_mesh(mesh).value();
    model.bounds = {Eigen::Vector3d::Constant(-2.0), Eigen::Vector3d::Constant(2.0)};
    model.levels = {{0.0, static_cast<std::uint32_t>(mesh.triangles.size()), 0, false}};
    model.absence_error_m = 2.0;
    model.rays = MeshRays::create(mesh).value();
    Scene scene = Scene::create({}).value();
    const ModelId rock = scene.add_model(model).value();
    test::Random random(5);
    const WorldPos middle(-4000.0, 7000.0, 500.0);
    std::vector<PlacedObject> objects(40);
    for (PlacedObject& object : objects) {
        object.position_world = middle + random.between(0.0, 9.0) * random.direction();
        object.scale = static_cast<float>(random.between(0.5, 1.5));
    }
    ASSERT_TRUE(scene.add_group(rock, objects));
    for (const double fov : {0.3, 1.0, 2.2}) {
        const View view = look_at(middle + WorldPos(14.0, -11.0, 5.0), middle + WorldPos(0, 0, 1),
                                  fov, kWidth, kHeight)
                              .value();
        ASSERT_TRUE(renderer.draw({}, view));
        const Image sky = renderer.read();
        scene.begin_frame(view);
        ASSERT_TRUE(renderer.draw({}, view, {}, scene.end_frame(0.01)));
        const Image image = renderer.read();
        int shown = 0, different = 0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                const auto pixel = 3u * static_cast<std::size_t>(y * kWidth + x);
                const bool is_shown = image.rgb[pixel] != sky.rgb[pixel] ||
                                      image.rgb[pixel + 1] != sky.rgb[pixel + 1] ||
                                      image.rgb[pixel + 2] != sky.rgb[pixel + 2];
                const Eigen::Vector3d along = direction_through(view, x + 0.5, y + 0.5);
                const bool is_met =
                    scene.ray(view.eye_world, view.eye_world + 100.0 * along).has_value();
                shown += is_shown ? 1 : 0;
                different += is_shown != is_met ? 1 : 0;
            }
        }
        EXPECT_GT(shown, 150) << fov;
        // the rasteriser rounds vertices to a 256th of a pixel
        EXPECT_LE(different, shown / 100) << fov;
    }
}

}  // namespace picking_test
}  // namespace terrane
