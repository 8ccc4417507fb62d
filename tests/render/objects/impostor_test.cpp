// SPDX-License-Identifier: MIT
#include "render/gl_test.h"
#include "render/scene.h"
#include "support/meshes/objects.h"

#include <terrane/render/impostor_error.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace terrane {
namespace impostor_test {

using test::count_different;
using test::make_rock;
using test::make_tree;

constexpr int kWidth = 240, kHeight = 200;

class ImpostorTest : public test::GlTest {
protected:
    TerrainRenderer make() {
        return TerrainRenderer::create(*context_, kWidth, kHeight, {}).value();
    }
    static Image draw(TerrainRenderer& renderer, const View& view, const SceneDraws& draws,
                      const TerrainMesh& mesh = {}) {
        const Result<void> drawn = renderer.draw(mesh, view, {}, draws);
        EXPECT_TRUE(drawn) << drawn.error().message;
        return renderer.read();
    }
};

ObjectInstance instance_at(const View& view, const WorldPos& place) {
    ObjectInstance instance;
    const LocalVec offset = to_local(place, view.eye_world);
    instance.offset_eye = {offset.x(), offset.y(), offset.z()};
    return instance;
}

View view_around(double distance, double azimuth) {
    const WorldPos target(0.0, 0.0, 4.0);
    return look_at(target + distance * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.1),
                   target, 0.7, kWidth, kHeight)
        .value();
}

double mean_difference(const Image& a, const Image& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
    return sum / static_cast<double>(a.rgb.size());
}

// docs/scenes.md has the table that this prints.
TEST_F(ImpostorTest, ItsErrorIsMeasuredAndGivesTheSizeAtWhichItTakesOver) {
    TerrainRenderer renderer = make();
    const std::array<double, 6> diameters = {8.0, 16.0, 32.0, 64.0, 96.0, 128.0};
    for (const bool is_tree : {true, false}) {
        for (const int views_above : {1, 5}) {
            const TriangleMesh mesh = is_tree ? make_tree(16) : make_rock(3, 1);
            const MeshId id = renderer.add_mesh(mesh).value();
            const ImpostorId impostor =
                renderer.add_impostor(id, {.views_above = views_above}).value();
            const ImpostorError error =
                measure_impostor(renderer, mesh, id, impostor, views_above == 1, diameters).value();
            ASSERT_EQ(error.sizes.size(), diameters.size());
            for (const ImpostorDifference& size : error.sizes) {
                std::printf("%s, views_above %d, %3.0f px: mean %4.1f levels, %4.1f %% by > 8\n",
                            is_tree ? "tree" : "rock", views_above, size.diameter_px, size.mean,
                            100.0 * size.share);
                EXPECT_GT(size.mean, 0.0);
                EXPECT_LE(size.share, 1.0);
            }
            std::printf("takes over at %.0f px, error_m %.3f\n", error.takeover_px, error.error_m);
            // a bound of the error in pixels is 1 where it takes over, by definition
            if (error.takeover_px > 0.0) {
                const ImpostorError strict =
                    measure_impostor(renderer, mesh, id, impostor, views_above == 1, diameters, 0.0)
                        .value();
                EXPECT_EQ(strict.takeover_px, 0.0);
                EXPECT_EQ(strict.error_m, std::numeric_limits<double>::infinity());
            }
            const ImpostorError other =
                measure_impostor(
                    renderer, mesh, id,
                    renderer.add_impostor(renderer.add_mesh(make_rock(1, 9)).value()).value(),
                    views_above == 1, std::array{64.0})
                    .value();
            // the impostor of something else is worse
            if (is_tree) {
                EXPECT_GT(other.sizes[0].mean, 1.5 * error.sizes[3].mean);
            }
        }
    }
    const TriangleMesh tree = make_tree(5);
    const MeshId id = renderer.add_mesh(tree).value();
    const ImpostorId impostor = renderer.add_impostor(id, {.texels = 8}).value();
    for (const double bad : {0.0, -1.0, 201.0, std::nan("")}) {
        EXPECT_FALSE(measure_impostor(renderer, tree, id, impostor, true, {&bad, 1})) << bad;
    }
    EXPECT_FALSE(measure_impostor(renderer, {}, id, impostor, true, diameters));
}

TEST_F(ImpostorTest, ItDoesNotPopWhileTheViewerGoesAroundIt) {
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_tree(16)).value();
    const ImpostorId impostor = renderer.add_impostor(id).value();
    const MeshDraw solid = {id, 0, 0, 1};
    const ImpostorDraw flat = {impostor, 0, 1};
    double largest = 0.0, largest_of_mesh = 0.0;
    Image before, before_of_mesh;
    for (int step = 0; step <= 48; ++step) {
        // a quarter of the angle between views in 12 steps of a rotation that stays before one sky
        View view = view_around(80.0, 0.0);
        ObjectInstance instance = instance_at(view, {0, 0, 0});
        const double half = 0.5 * step / 48.0 * 0.7854;
        instance.rotation = {0.0f, 0.0f, static_cast<float>(std::sin(half)),
                             static_cast<float>(std::cos(half))};
        const Image now =
            draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&flat, 1}});
        const Image of_mesh =
            draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&solid, 1}});
        if (step > 0) {
            largest = std::max(largest, mean_difference(before, now));
            largest_of_mesh = std::max(largest_of_mesh, mean_difference(before_of_mesh, of_mesh));
        }
        before = now;
        before_of_mesh = of_mesh;
    }
    const View view = view_around(80.0, 0.0);
    const ObjectInstance instance = instance_at(view, {0, 0, 0});
    const double whole = mean_difference(
        draw(renderer, view, {}),
        draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&flat, 1}}));
    std::printf("largest step: impostor %.4f, mesh %.4f, whole %.4f\n", largest, largest_of_mesh,
                whole);
    EXPECT_LT(largest, 0.1 * whole);
}

// Columns by how far the lowest pixels of both pictures are apart: where objects meet the ground.
TEST_F(ImpostorTest, ItsLineWithTheGroundIsWithinAPixelOfTheMeshes) {
    const test::Scene world = test::make_scene();
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_rock(3, 2)).value();
    const ImpostorId impostor = renderer.add_impostor(id, {.texels = 128}).value();
    const WorldPos place(150.0, 120.0, world.height(150.0, 120.0));
    const View view =
        look_at(place + Eigen::Vector3d(-60.0, -40.0, 60.0), place, 0.25, kWidth, kHeight).value();
    ObjectInstance instance = instance_at(view, place);
    instance.scale = 4.0f;
    instance.tint = {9.0f, 0.0f, 0.0f};  // unlike the ground
    const MeshDraw solid = {id, 0, 0, 1};
    const ImpostorDraw flat = {impostor, 0, 1};
    draw(renderer, view, {}, world.mesh());
    const Image empty = draw(renderer, view, {}, world.mesh());
    const Image a =
        draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&solid, 1}}, world.mesh());
    const Image b =
        draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&flat, 1}}, world.mesh());
    const auto lowest = [&](const Image& image, int x) {
        for (int y = kHeight - 1; y >= 0; --y) {
            const auto at = 3 * static_cast<std::size_t>(y * kWidth + x);
            if (std::abs(int{image.rgb[at + 1]} - int{empty.rgb[at + 1]}) > 24) return y;
        }
        return -1;
    };
    int columns = 0, beyond = 0;
    for (int x = 0; x < kWidth; ++x) {
        const int solid_y = lowest(a, x), flat_y = lowest(b, x);
        if (solid_y < 0 || flat_y < 0) continue;
        ++columns;
        beyond += std::abs(solid_y - flat_y) > 1 ? 1 : 0;
    }
    std::printf("%d columns, %d more than a pixel off\n", columns, beyond);
    EXPECT_GT(columns, 20);
    EXPECT_LE(beyond, columns / 20);
}

}  // namespace impostor_test
}  // namespace terrane
