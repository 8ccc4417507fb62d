// SPDX-License-Identifier: MIT
#include "light/shadow_maps.h"
#include "render/render_scene.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace terrane::internal {
namespace sun_cascades_test {

constexpr int kTexels = 512;

struct Case {
    View view;
    Eigen::Vector3d sun;
    double distance = 0.0;
};

void turn(View& view, const Eigen::Vector3d& forward) {
    view.forward = forward;
    const Eigen::Vector3d side = std::abs(forward.z()) < 0.9 ? Eigen::Vector3d::UnitZ().eval()
                                                             : Eigen::Vector3d::UnitX().eval();
    view.up = (side - side.dot(forward) * forward).normalized();
}

std::vector<Case> random_cases(int count) {
    test::Random random(7);
    std::vector<Case> cases;
    for (int i = 0; i < count; ++i) {
        Case made;
        turn(made.view, random.direction());
        made.view.eye_world = 1e6 * random.direction();
        made.view.vertical_fov = random.between(0.1, 2.4);
        made.view.width_px = 100 + i % 7 * 200;
        made.sun = random.direction();
        made.sun.z() = std::abs(made.sun.z()) + 0.01;
        made.distance = std::exp2(random.between(0.0, 14.0));
        cases.push_back(made);
    }
    return cases;
}

TEST(SunCascades, HoldEveryPointThatTheViewShowsWithinTheirReach) {
    test::Random random(11);
    for (const Case& each : random_cases(200)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        EXPECT_DOUBLE_EQ(cascades.back().reach, each.distance);
        const double half_height = std::tan(0.5 * each.view.vertical_fov);
        const double half_width = half_height * each.view.width_px / each.view.height_px;
        for (const SunCascade& cascade : cascades) {
            // two texels are left for the filter
            const double limit = cascade.half_side * (1.0 - 4.0 / kTexels);
            for (int i = 0; i < 50; ++i) {
                // corners of the picture too
                const double u = i < 4 ? 2.0 * (i & 1) - 1.0 : random.between(-1.0, 1.0);
                const double v = i < 4 ? (i & 2) - 1.0 : random.between(-1.0, 1.0);
                const Eigen::Vector3d ray = each.view.forward + u * half_width * each.view.right() +
                                            v * half_height * each.view.up;
                const double distance =
                    cascade.reach * (i % 3 == 0 ? 1.0 : random.between(0.0, 1.0));
                const WorldPos p = each.view.eye_world + distance * ray.normalized();
                const Eigen::Vector3d from_centre = cascade.axes * p - cascade.centre;
                for (int axis = 0; axis < 3; ++axis)
                    ASSERT_LE(std::abs(from_centre[axis]), limit) << axis;
            }
        }
    }
}

TEST(SunCascades, MoveByWholeTexelsAndKeepTheirSideWhereverTheEyeLooks) {
    test::Random random(13);
    for (const Case& each : random_cases(50)) {
        const auto before = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        View moved = each.view;
        turn(moved, random.direction());
        moved.eye_world += each.distance * random.direction();
        const auto after = make_sun_cascades(moved, each.sun, each.distance, kTexels);
        for (std::size_t i = 0; i < kCascades; ++i) {
            EXPECT_EQ(before[i].half_side, after[i].half_side);
            EXPECT_EQ(before[i].axes, after[i].axes);
            const Eigen::Vector3d steps =
                (after[i].centre - before[i].centre) * (kTexels / (2.0 * before[i].half_side));
            for (int axis = 0; axis < 2; ++axis)
                EXPECT_NEAR(steps[axis], std::round(steps[axis]), 1e-5);
        }
    }
}

TEST(SunCascades, MeetWhatIsBetweenTheMapAndTheSunAndLeaveTheRest) {
    test::Random random(17);
    int left_out = 0;
    for (const Case& each : random_cases(300)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        for (const SunCascade& cascade : cascades) {
            const double side = cascade.half_side;
            // a point above the map
            const Eigen::Vector3d along =
                cascade.centre + Eigen::Vector3d(side * random.between(-1.0, 1.0),
                                                 side * random.between(-1.0, 1.0),
                                                 side * random.between(-1.0, 50.0));
            const WorldPos p = cascade.axes.transpose() * along;
            const Eigen::Vector3d size = random.between(0.0, side) * Eigen::Vector3d(1.0, 1.0, 1.0);
            const Eigen::Vector3d margin = size + Eigen::Vector3d::Constant(1e-7 * p.norm());
            EXPECT_TRUE(cascade.meets(Aabb{p - margin, p + 2.0 * margin}));
            EXPECT_TRUE(cascade.meets(BoundingSphere{p, 1e-7 * p.norm()}));
            // beside the map, and behind it
            for (const Eigen::Vector3d& away :
                 {Eigen::Vector3d(2.0, 0.0, 0.0), Eigen::Vector3d(0.0, -2.0, 3.0),
                  Eigen::Vector3d(0.0, 0.0, -2.0)}) {
                const WorldPos q = cascade.axes.transpose() * (cascade.centre + 1.01 * side * away);
                EXPECT_FALSE(cascade.meets(BoundingSphere{q, side}));
                const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * side);
                left_out += cascade.meets(Aabb{q - half, q + half}) ? 0 : 1;
            }
        }
    }
    // a box of half the map's side reaches at most 0.87 of it
    EXPECT_EQ(left_out, 300 * 9);
}

TEST(SunCascades, TheirMatrixPutsTheSunsSideNearest) {
    for (const Case& each : random_cases(50)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        for (const SunCascade& cascade : cascades) {
            const auto clip = cascade.clip_from_eye(each.view.eye_world);
            const auto to_clip = [&](const Eigen::Vector3d& from_centre) {
                const Eigen::Vector3d p_eye =
                    cascade.axes.transpose() *
                    (cascade.centre_from(each.view.eye_world) + cascade.half_side * from_centre);
                Eigen::Vector3d clipped;
                for (std::size_t row = 0; row < 3; ++row) {
                    clipped[static_cast<int>(row)] =
                        static_cast<double>(clip[row]) * p_eye.x() +
                        static_cast<double>(clip[row + 4]) * p_eye.y() +
                        static_cast<double>(clip[row + 8]) * p_eye.z() +
                        static_cast<double>(clip[row + 12]);
                }
                return clipped;
            };
            EXPECT_LT((to_clip({0.0, 0.0, 1.0}) - Eigen::Vector3d(0.0, 0.0, 1.0)).norm(), 1e-5);
            EXPECT_LT((to_clip({1.0, -1.0, -1.0}) - Eigen::Vector3d(1.0, -1.0, 0.0)).norm(), 1e-5);
        }
    }
}

}  // namespace sun_cascades_test
}  // namespace terrane::internal

namespace terrane {
namespace shadow_test {

using test::brightness;
using test::largest_difference;
using test::make_plane_scene;
using test::Scene;

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFov = 0.3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

RendererSettings with_sun(const Eigen::Vector3d& sun, double shadow_distance) {
    return {.sun_direction = sun,
            .haze_distance = kInfinity,
            .sample_count = 1,
            .shadow_distance = shadow_distance};
}

// From above, so that a pixel of the plane z = 0 is metres / kPixelsPerMetre.
constexpr double kPixelsPerMetre = 10.0;
View view_down(double x, double y) {
    const double height = kHeight / kPixelsPerMetre / (2.0 * std::tan(0.5 * kFov));
    return *look_at({x, y, height}, {x, y, 0.0}, kFov, kWidth, kHeight);
}

test::Solid box_at(double x, double y, double half) {
    test::Solid box;
    box.extents = Eigen::Vector3d::Constant(half);
    box.world_from_solid.translation = {x, y, half};
    return box;
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

class ShadowTest : public test::PictureTest<kWidth, kHeight> {
protected:
    Image draw(const RendererSettings& settings, const Scene& scene, const View& view,
               std::span<const test::Solid> objects = {}) {
        TerrainRenderer renderer = make(settings);
        return test::draw(renderer, scene.mesh(), view, objects);
    }
};

TEST_F(ShadowTest, ABoxCastsItsShadowWhereTheSunSaysItShould) {
    const Scene scene = make_plane_scene();
    const View view = view_down(260.0, 128.0);
    const test::Solid box = box_at(256.0, 128.0, 2.0);
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
    const bool is_long = test::few_or_many(0, 1) != 0;
    int compared = 0;
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
            const double distances[] = {20.0, 100.0, 400.0};
            for (int k = 0; k < 3; ++k) {
                if (!is_long && i % 3 != k) continue;
                const double distance = distances[k];
                SCOPED_TRACE(testing::Message() << slope << " " << i << " " << distance);
                const WorldPos target(256.0, 128.0, 0.0);
                const Eigen::Vector3d from = (0.5 * normal - Eigen::Vector3d::UnitY()).normalized();
                const View view = view_from(target + 0.3 * distance * from, target);
                EXPECT_LE(largest_difference(draw(with_sun(sun, distance), scene, view),
                                             draw(with_sun(sun, 0.0), scene, view)),
                          2);
                ++compared;
            }
        }
    }
    EXPECT_EQ(compared, is_long ? 72 : 24);
}

TEST_F(ShadowTest, ShadowsStayWhereTheyAreWhileTheEyeTurns) {
    const Scene scene = make_plane_scene();
    const test::Solid box = box_at(256.0, 128.0, 2.0);
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
    // the west is 50 m higher, down to its eastern edge: with the sun at 45 degrees the shadow ends at x = 304
    test::raise_western_root(scene, 50.0f);
    for (int row = 0; row < kChunkSamples; ++row)
        scene.offsets.back()[sample_index(kChunkCells, row)] = 0.0f;
    const Eigen::Vector3d sun(-1.0, 0.0, 1.0);
    for (const double x : {285.0, 340.0}) {
        const View view = view_down(x, 128.0);
        const Image dark = draw(with_sun(sun, 300.0), scene, view);
        const Darkened found = darkened(dark, draw(with_sun(sun, 0.0), scene, view));
        EXPECT_EQ(found.count, x < 304.0 ? kWidth * kHeight : 0) << x;
    }
}

TEST_F(ShadowTest, FadesTowardsItsDistance) {
    const Scene scene = make_plane_scene();
    const Eigen::Vector3d sun(-1.0, 0.0, 1.0);
    const test::Solid box = box_at(256.0, 128.0, 4.0);
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
    const View view = view_down(262.0, 128.0);
    const ObjectInstance instance = test::instance_at(view, {256.0, 128.0, 0.0});
    Image images[2][2];
    for (const bool has_shadows : {false, true}) {
        TerrainRenderer renderer = make(with_sun({-1.0, 0.2, 0.7}, has_shadows ? 300.0 : 0.0));
        const MeshId mesh = renderer.add_mesh(test::make_tree(16)).value();
        const MeshDraw as_mesh{.mesh = mesh, .instance_count = 1};
        const ImpostorDraw as_impostor{
            .impostor = renderer.add_impostor(mesh, {.views_above = 5}).value(),
            .instance_count = 1};
        images[0][has_shadows] = test::draw(
            renderer, view, {.instances = {&instance, 1}, .meshes = {&as_mesh, 1}}, scene.mesh());
        images[1][has_shadows] =
            test::draw(renderer, view,
                       {.instances = {&instance, 1}, .impostors = {&as_impostor, 1}}, scene.mesh());
    }
    const Darkened of_mesh = darkened(images[0][1], images[0][0]),
                   of_impostor = darkened(images[1][1], images[1][0]);
    EXPECT_GT(of_mesh.count, 300);
    EXPECT_NEAR(of_impostor.count, of_mesh.count, 0.25 * of_mesh.count);
    EXPECT_NEAR(of_impostor.x, of_mesh.x, 6.0);
    EXPECT_NEAR(of_impostor.y, of_mesh.y, 6.0);
}

TEST_F(ShadowTest, TakesMemoryOnlyWhereItIsAskedFor) {
    EXPECT_EQ(make().buffer_bytes(), 0u);
    EXPECT_EQ(make({.shadow_distance = 100.0, .shadow_texels = 512}).buffer_bytes(),
              12u * 512u * 512u);
}

}  // namespace shadow_test

namespace scene_caster_test {

using test::brightness;

constexpr int kWidth = 160, kHeight = 120, kWideWidth = 480;
constexpr double kFov = 0.3;
const WorldPos kObject(256.0, 128.0, 0.0);

// From above: 10 pixels a metre, whatever the width.
View view_down(double x, int width_px) {
    const double height = 12.0 / (2.0 * std::tan(0.5 * kFov));
    return *look_at({x, 128.0, height}, {x, 128.0, 0.0}, kFov, width_px, kHeight);
}

// Draws a tree in a plane, 20 m west of the middle of the picture, by a Scene.
class SceneCasterTest : public test::PictureTest<kWidth, kHeight> {
protected:
    struct Drawn {
        Image image;
        DrawCounts counts;
        std::size_t casters = 0;
    };
    // From the west: the shadow of the tree of 8 m reaches 24 m.
    static RendererSettings with_shadows(double distance) {
        return {.sun_direction = {-3.0, 0.0, 1.0},
                .haze_distance = std::numeric_limits<double>::infinity(),
                .sample_count = 1,
                .shadow_distance = distance,
                .shadow_texels = 4096};
    }
    Drawn draw(const View& view, double shadow_distance, bool gives_casters, bool is_impostor) {
        const RendererSettings settings = with_shadows(shadow_distance);
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
        const PlacedObject object{.position = kObject};
        EXPECT_TRUE(
            scene.add(scene.root(), {}, InstancesNode{scene.add_model(model).value(), {object}}));
        scene.begin_frame(view, 0.0, gives_casters ? renderer.shadows() : std::nullopt);
        Image image = test::draw(renderer, view, scene.end_frame(1.0), plane_.mesh());
        return {std::move(image), renderer.counts(), scene.counts().casters};
    }

    const test::Scene plane_ = test::make_plane_scene();
};

TEST_F(SceneCasterTest, AnObjectOutOfViewDarkensThePictureAsWhereAWiderViewSeesIt) {
    const double x = kObject.x() + 20.0;
    const Drawn missing = draw(view_down(x, kWidth), 200.0, false, false);
    const Drawn bright = draw(view_down(x, kWidth), 0.0, true, false);
    EXPECT_EQ(test::largest_difference(missing.image, bright.image), 0)
        << "without its caster the picture has no shadow";
    EXPECT_EQ(bright.casters, 0u) << "a renderer without shadows asks for no casters";
    for (const bool is_impostor : {false, true}) {
        SCOPED_TRACE(is_impostor);
        const Drawn narrow = draw(view_down(x, kWidth), 200.0, true, is_impostor);
        const Drawn wide = draw(view_down(x, kWideWidth), 200.0, true, is_impostor);
        EXPECT_EQ(narrow.casters, 1u);
        EXPECT_EQ(narrow.counts.objects_drawn, 0u);
        EXPECT_EQ(narrow.counts.triangles, 0u);
        EXPECT_EQ(wide.casters, 0u);
        EXPECT_EQ(wide.counts.objects_drawn, 1u);
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
    TerrainRenderer renderer = make(with_shadows(200.0));
    const TriangleMesh tree = test::make_tree(16);
    ObjectModel model;
    model.mesh = renderer.add_mesh(tree).value();
    model.bounds = bounding_box(tree.positions);
    model.levels = {{.triangles = static_cast<std::uint32_t>(tree.triangles.size())}};
    model.absence_error_m = std::numeric_limits<double>::infinity();
    Scene scene = Scene::create({}).value();
    const ModelNode node{.model = scene.add_model(model).value()};
    ASSERT_TRUE(scene.add(scene.root(), {.parent_from_node = {.translation = kObject}}, node));
    const View view = view_down(kObject.x() + 20.0, kWidth);
    Image images[2];
    for (const bool gives_casters : {false, true}) {
        scene.begin_frame(view, 0.0, gives_casters ? renderer.shadows() : std::nullopt);
        const SceneDraws draws = scene.end_frame(1.0);
        images[gives_casters ? 1 : 0] = test::draw(renderer, view, draws, plane_.mesh());
        EXPECT_EQ(renderer.counts().objects_drawn, 0u);
    }
    EXPECT_GT(test::count_different(images[0], images[1], 30), 300);
}

TEST_F(SceneCasterTest, CastersThatDoNotExistAreRefusedWhereThereAreShadows) {
    const View view = view_down(kObject.x(), kWidth);
    const MeshDraw no_mesh{.mesh = MeshId{7}, .instance_count = 0};
    const ImpostorDraw no_impostor{.impostor = ImpostorId{8}, .instance_count = 0};
    for (const double distance : {0.0, 100.0}) {
        TerrainRenderer renderer = make({.shadow_distance = distance});
        const Result<void> with_mesh =
            renderer.draw(plane_.mesh(), view, {.caster_meshes = {&no_mesh, 1}});
        const Result<void> with_impostor =
            renderer.draw(plane_.mesh(), view, {.caster_impostors = {&no_impostor, 1}});
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
