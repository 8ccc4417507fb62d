// SPDX-License-Identifier: MIT
#include "render/render_scene.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/render/upload_levels.h>
#include <terrane/scene/object_levels.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane {
namespace impostor_test {

using test::count_different;
using test::draw;
using test::few_or_many;
using test::instance_at;
using test::make_rock;
using test::make_tree;

constexpr int kWidth = 240, kHeight = 200;

class ImpostorTest : public test::PictureTest<kWidth, kHeight> {};

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

// TERRANE_LONG=1 prints the table of docs/objects.md.
TEST_F(ImpostorTest, ItsErrorIsMeasuredAndGivesTheSizeAtWhichItTakesOver) {
    constexpr int kSide = 136;
    TerrainRenderer renderer = TerrainRenderer::create(*context_, kSide, kSide, {}).value();
    const bool is_long = few_or_many(0, 1) != 0;
    const std::vector<double> diameters =
        is_long ? std::vector{8.0, 16.0, 32.0, 64.0, 96.0, 128.0} : std::vector{16.0, 64.0, 128.0};
    for (const auto& [is_tree, views_above] :
         {std::pair{true, 1}, {true, 5}, {false, 1}, {false, 5}}) {
        if (!is_long && is_tree == (views_above == 1)) continue;
        const TriangleMesh mesh = is_tree ? make_tree(16) : make_rock(3, 1);
        const MeshId id = renderer.add_mesh(mesh).value();
        const ImpostorId impostor = renderer.add_impostor(id, {.views_above = views_above}).value();
        const auto measure = [&](ImpostorId of, std::span<const double> at, double accepted_px) {
            return measure_impostor(renderer, mesh, id, of, views_above == 1, at, accepted_px)
                .value();
        };
        const ImpostorError error = measure(impostor, diameters, 1.0);
        ASSERT_EQ(error.sizes.size(), diameters.size());
        double mean_of_64 = 0.0;
        for (const ImpostorDifference& size : error.sizes) {
            std::printf(
                "%s, views_above %d, %3.0f px: mean %4.1f levels, %4.1f %% by > 8, as "
                "displaced by %.2f px\n",
                is_tree ? "tree" : "rock", views_above, size.diameter_px, size.mean,
                100.0 * size.share, size.displacement_px);
            EXPECT_GT(size.mean, 0.0);
            EXPECT_LE(size.share, 1.0);
            if (size.diameter_px == 64.0) mean_of_64 = size.mean;
        }
        std::printf("takes over at %.0f px, error_m %.3f\n", error.takeover_px, error.error_m);
        // where it takes over it looks like its mesh displaced by a pixel at most
        EXPECT_GE(error.takeover_px, 64.0);
        const std::array only_64 = {64.0};
        const ImpostorError strict = measure(impostor, only_64, 1e-6);
        EXPECT_EQ(strict.takeover_px, 0.0);
        EXPECT_EQ(strict.error_m, std::numeric_limits<double>::infinity());
        if (!is_tree) continue;
        const MeshId other = renderer.add_mesh(make_rock(1, 9)).value();
        EXPECT_GT(measure(renderer.add_impostor(other).value(), only_64, 1.0).sizes[0].mean,
                  1.5 * mean_of_64)
            << "the impostor of something else is worse";
    }
    const TriangleMesh tree = make_tree(5);
    const MeshId id = renderer.add_mesh(tree).value();
    const ImpostorId impostor = renderer.add_impostor(id, {.texels = 8}).value();
    for (const double bad : {0.0, -1.0, kSide + 1.0, std::nan("")}) {
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

// The lowest pixels of the columns, where an object of no green meets the ground: half of the pixel is covered.
std::vector<std::array<int, 2>> line_with_ground(const Image& image, const Image& empty) {
    std::vector<std::array<int, 2>> line;
    for (int x = 0; x < image.width; ++x) {
        for (int y = image.height - 1; y >= 0; --y) {
            const auto green = 3 * static_cast<std::size_t>(y * image.width + x) + 1;
            if (2 * int{image.rgb[green]} >= int{empty.rgb[green]}) continue;
            line.push_back({x, y});
            break;
        }
    }
    return line;
}

// Points of a line that have no point of the other within a pixel.
int count_beyond(const std::vector<std::array<int, 2>>& line,
                 const std::vector<std::array<int, 2>>& other) {
    return static_cast<int>(std::count_if(line.begin(), line.end(), [&](const auto& p) {
        return std::none_of(other.begin(), other.end(), [&](const auto& q) {
            return std::abs(p[0] - q[0]) <= 1 && std::abs(p[1] - q[1]) <= 1;
        });
    }));
}

TEST_F(ImpostorTest, ItsLineWithTheGroundIsWithinAPixelOfTheMeshes) {
    const test::Scene world = test::make_scene();
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_rock(3, 2)).value();
    const WorldPos place(150.0, 120.0, world.height(150.0, 120.0));
    const MeshDraw solid = {id, 0, 0, 1};
    const int most_above = few_or_many(8, 16);
    for (const auto& [around, above] : {std::pair{16, 4}, {16, 8}, {32, 16}}) {
        if (above > most_above) continue;
        const ImpostorId impostor =
            renderer.add_impostor(id, {.views_around = around, .views_above = above, .texels = 128})
                .value();
        const ImpostorDraw flat = {impostor, 0, 1};
        int points = 0, beyond = 0;
        for (int side = 0; side < 8; ++side) {
            const double azimuth = 0.77 * side, elevation = 0.3 + 0.12 * side;
            const Eigen::Vector3d back(std::cos(azimuth) * std::cos(elevation),
                                       std::sin(azimuth) * std::cos(elevation),
                                       std::sin(elevation));
            const View view = look_at(place + 94.0 * back, place, 0.25, kWidth, kHeight).value();
            ObjectInstance instance = instance_at(view, place);
            instance.scale = 4.0f;
            instance.tint = {9.0f, 0.0f, 0.0f};  // no green
            draw(renderer, view, {}, world.mesh());
            const Image empty = draw(renderer, view, {}, world.mesh());
            const auto a = line_with_ground(
                draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&solid, 1}},
                     world.mesh()),
                empty);
            const auto b = line_with_ground(
                draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&flat, 1}},
                     world.mesh()),
                empty);
            points += static_cast<int>(a.size() + b.size());
            beyond += count_beyond(a, b) + count_beyond(b, a);
        }
        std::printf("%d x %d views: %d of %d points more than a pixel off\n", around, above, beyond,
                    points);
        EXPECT_GT(points, 400);
        EXPECT_LE(beyond, points / 100) << around << " x " << above;
    }
}

// Meshes near, a cross-fade between 60 and 90 m, impostors beyond.
TEST_F(ImpostorTest, AForestThatFadesFromMeshesToImpostorsLooksLikeOneOfMeshes) {
    const test::Scene world = test::make_scene();
    TerrainRenderer renderer =
        TerrainRenderer::create(*context_, 4 * kWidth, 2 * kHeight, {}).value();
    const MeshId id = renderer.add_mesh(make_tree(16)).value();
    const ImpostorId impostor = renderer.add_impostor(id).value();
    const WorldPos eye(250.0, 15.0, world.height(250.0, 15.0) + 14.0);
    const View view =
        look_at(eye, eye + Eigen::Vector3d(0.0, 100.0, -12.0), 0.8, 4 * kWidth, 2 * kHeight)
            .value();
    std::vector<ObjectInstance> all, near, far;
    for (int i = 0; i < 900; ++i) {
        const double x = 140.0 + 7.4 * (i % 30) + 3.0 * std::sin(12.9 * i);
        const int row = i / 30;
        const double y = 25.0 + 7.1 * row + 3.0 * std::sin(78.2 * i);
        ObjectInstance tree = instance_at(view, {x, y, world.height(x, y)});
        tree.scale = 0.8f + 0.2f * static_cast<float>(std::sin(3.7 * i));
        all.push_back(tree);
        const double distance = std::hypot(x - eye.x(), y - eye.y());
        const auto share = static_cast<float>(std::clamp((90.0 - distance) / 30.0, 0.0, 1.0));
        tree.coverage = share;
        if (share > 0.0f) near.push_back(tree);
        tree.coverage = share > 0.0f ? share - 1.0f : 1.0f;
        if (share < 1.0f) far.push_back(tree);
    }
    ASSERT_GT(near.size(), 50u);
    ASSERT_GT(far.size(), 500u);
    const MeshDraw meshes = {id, 0, 0, static_cast<std::uint32_t>(all.size())};
    std::vector<ObjectInstance> mixed = near;
    mixed.insert(mixed.end(), far.begin(), far.end());
    const auto near_count = static_cast<std::uint32_t>(near.size());
    const MeshDraw near_draw = {id, 0, 0, near_count};
    const ImpostorDraw far_draw = {impostor, near_count, static_cast<std::uint32_t>(far.size())};
    draw(renderer, view, {}, world.mesh());
    const Image empty = draw(renderer, view, {}, world.mesh());
    const Image a = draw(renderer, view, {.instances = all, .meshes = {&meshes, 1}}, world.mesh());
    const Image b = draw(
        renderer, view,
        {.instances = mixed, .meshes = {&near_draw, 1}, .impostors = {&far_draw, 1}}, world.mesh());
    std::printf("forest: mean difference %.2f levels, %.1f %% of pixels by > 8; bare %.2f\n",
                mean_difference(a, b), 100.0 * count_different(a, b, 8) / (8.0 * kWidth * kHeight),
                mean_difference(a, empty));
    EXPECT_LT(mean_difference(a, b), 0.1 * mean_difference(a, empty));
}

// The threshold grows by 1 % a frame, as when an eye 100 m away leaves at 30 m/s, in 30 frames a second.
TEST_F(ImpostorTest, AChangeOfLevelsChangesFewPixelsOfAnObjectInAFrame) {
    struct Object {
        const char* name;
        TriangleMesh mesh;
        double distance;  // at which it changes with an error of about a pixel
    };
    const Object objects[] = {{"tree", make_tree(16), 45.0}, {"rock", make_rock(3, 5), 12.0}};
    for (const auto& [name, mesh, distance] : objects) {
        TerrainRenderer renderer = make({.sample_count = 1});
        ObjectLevels levels = make_object_levels(std::span(&mesh, 1)).value();
        ASSERT_TRUE(upload_levels(levels, {}, renderer));
        Scene scene = Scene::create({}).value();
        const ModelId model = scene.add_model(levels.model).value();
        ASSERT_TRUE(scene.add(scene.root(), {}, ModelNode{.model = model}));
        const View view = view_around(distance, 0.7);
        const Image empty = draw(renderer, view, {});
        std::optional<Image> before;
        constexpr double kStep = 1.01;
        double worst = 0.0;
        std::size_t most_drawn = 0, least_drawn = std::numeric_limits<std::size_t>::max();
        for (double threshold = 0.05; threshold < 12.0; threshold *= kStep) {
            scene.begin_frame(view, threshold);
            const Image now = draw(renderer, view, scene.end_frame(threshold));
            if (before) {
                const int own = count_different(now, empty);
                worst = std::max(worst, 1.0 * count_different(now, *before, 8) / own);
            }
            before = now;
            most_drawn = std::max(most_drawn, scene.counts().triangles);
            least_drawn = std::min(least_drawn, scene.counts().triangles);
        }
        std::printf("%s: from %zu to %zu triangles, at most %.2f %% of its pixels by > 8 a frame\n",
                    name, most_drawn, least_drawn, 100.0 * worst);
        EXPECT_GE(most_drawn, mesh.triangles.size() / 2);
        EXPECT_LE(least_drawn, 2u) << "an impostor";
        EXPECT_LE(worst, 0.02);
    }
}

}  // namespace impostor_test
}  // namespace terrane
