// SPDX-License-Identifier: MIT
#include "frames/object_field.h"

#include "scene/mesh_files.h"
#include "support/grounds.h"
#include "support/meshes.h"

#include <terrane/render/upload_levels.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/object_levels.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/composed_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <thread>
#include <utility>

namespace terrane::tools {
namespace object_field_test {

SceneObjects forest(double per_km2) {
    SceneObjects objects;
    objects.meshes = {test::make_tree(12), test::make_rock(3, 1)};
    objects.files = {"tree.obj", "rock.obj"};
    objects.scatters = {{0, {.per_km2 = per_km2, .seed = 1}}};
    objects.objects = {{1, {Eigen::Matrix3d::Identity(), {0.0, 60.0, 30.0}}, 2.0}};
    return objects;
}

View view_along(const WorldPos& eye) {
    View view;
    view.eye_world = eye;
    return view;
}

ObjectField make_field(const std::shared_ptr<const HeightSource>& source,
                       const SceneObjects& objects, double max_error_px, const View& picture,
                       bool has_thread = false) {
    return ObjectField::create(
               source, objects,
               {.max_error_px = max_error_px, .picture = picture, .has_thread = has_thread},
               nullptr)
        .value();
}

// What a field counts in a view of which all is loaded.
ObjectCounts counts_of(ObjectField& field, const View& view, double max_error_px) {
    field.load_all(view);
    field.begin_frame(view);
    field.end_frame(max_error_px);
    return field.counts();
}

// Heights that answer only while its gate is open.
class GatedHeights : public ForwardedHeights {
public:
    explicit GatedHeights(std::shared_ptr<const HeightSource> heights)
        : ForwardedHeights(std::move(heights)) {}
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        is_open.wait(false);
        return ForwardedHeights::sample(grid, heights_out);
    }
    void open() {
        is_open = true;
        is_open.notify_all();
    }
    std::atomic<bool> is_open{true};
};

TEST(ObjectField, DrawsTheNearestOfManyTrianglesWithLevelsOfTheirOwn) {
    SceneObjects objects;
    objects.meshes = {test::make_rock(5, 1)};
    objects.files = {"rock.obj"};
    objects.objects = {{0, {Eigen::Matrix3d::Identity(), {0.0, 6.0, 0.0}}, 1.0}};
    const View view = view_along({0.0, 0.0, 0.0});
    ObjectField field = make_field(test::fractal_hills(), objects, 1.0, view);
    field.begin_frame(view);
    const SceneDraws draws = field.end_frame(1.0);
    EXPECT_TRUE(draws.meshes.empty());
    ASSERT_EQ(draws.streamed.size(), 1u);
    EXPECT_LT(draws.streamed[0].triangles.size(), 10000u);
    EXPECT_EQ(field.counts().triangles, draws.streamed[0].triangles.size());
}

TEST(ObjectField, HasTheObjectsOfAllSquaresInRangeOnceTheyAreLoaded) {
    const auto source = test::fractal_hills();
    const SceneObjects objects = forest(400.0);
    const View view = view_along({0.0, -300.0, 90.0});
    ObjectField field = make_field(source, objects, 1.0, view);
    const ObjectCounts all = counts_of(field, view, 1.0);
    // every object of the scatter that the view must show, found without squares' ranges
    const Scatter scatter = Scatter::create(source, objects.scatters[0].settings).value();
    const ObjectLevels levels = make_object_levels(objects.meshes[0]).value();
    const ViewVolume volume(view);
    const WorldRect& extent = source->extent();
    const ScatterSquare first = scatter.square_at(extent.west, extent.south);
    const ScatterSquare last = scatter.square_at(extent.east, extent.north);
    std::size_t needed = 0;
    for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
            for (const ScatterPoint& point : points) {
                const double distance = (point.position_world - view.eye_world).norm();
                const double px = levels.model.absence_error_m * point.scale *
                                  view.pixels_per_radian() / distance;
                const BoundingSphere middle = {point.position_world + Eigen::Vector3d(0, 0, 4),
                                               0.0};
                needed += px > 1.5 && volume.meets(middle) ? 1u : 0u;
            }
        }
    }
    EXPECT_GT(needed, 100u);
    EXPECT_GE(all.drawn, needed);
    EXPECT_EQ(all.failed_squares, 0u);
}

TEST(ObjectField, SquaresComeInAFewAFrameAndAFlightEndsAsIfLoadedAtOnce) {
    const auto source = test::fractal_hills();
    const SceneObjects objects = forest(400.0);
    View view = view_along({-900.0, -300.0, 90.0});
    ObjectField flown = make_field(source, objects, 4.0, view);
    flown.load_all(view);
    for (int frame = 0; frame < 150; ++frame) {
        view.eye_world.x() += 10.0;
        flown.begin_frame(view);
        flown.end_frame(4.0);
    }
    for (int frame = 0; frame < 50; ++frame) flown.begin_frame(view);
    flown.end_frame(4.0);
    ObjectField field = make_field(source, objects, 4.0, view);
    const ObjectCounts fresh = counts_of(field, view, 4.0);
    EXPECT_EQ(flown.counts().drawn, fresh.drawn);
    EXPECT_EQ(flown.counts().triangles, fresh.triangles);
    EXPECT_GT(fresh.drawn, 50u);
}

TEST(ObjectField, FramesDoNotWaitForTheSourceAndSquaresComeWhenItAnswers) {
    const auto source = std::make_shared<GatedHeights>(test::fractal_hills());
    const SceneObjects objects = forest(400.0);
    View view = view_along({-900.0, -300.0, 90.0});
    ObjectField field = make_field(source, objects, 4.0, view, true);
    field.load_all(view);
    source->is_open = false;
    // each of these frames would hang if it asked the source
    for (int frame = 0; frame < 100; ++frame) {
        view.eye_world.x() += 15.0;
        field.begin_frame(view);
        field.end_frame(4.0);
    }
    source->open();
    ObjectField fresh = make_field(source, objects, 4.0, view);
    const std::size_t drawn = counts_of(fresh, view, 4.0).drawn;
    EXPECT_EQ(counts_of(field, view, 4.0).drawn, drawn);
    EXPECT_GT(drawn, 50u);
}

TEST(ObjectField, EndsWhileItsThreadWaitsForTheSource) {
    const auto source = std::make_shared<GatedHeights>(test::fractal_hills());
    const View view = view_along({0.0, -300.0, 90.0});
    source->is_open = false;
    std::jthread opener;
    {
        ObjectField field = make_field(source, forest(400.0), 1.0, view, true);
        field.begin_frame(view);
        opener = std::jthread([&] { source->open(); });
    }
}

TEST(ObjectField, HasNoObjectsFarFromTheWorldAndHoldsAtTinyTargets) {
    const auto source = test::fractal_hills();
    View view = view_along({1e12, -1e12, 0.0});
    ObjectField far = make_field(source, forest(400.0), 1.0, view);
    EXPECT_EQ(counts_of(far, view, 1.0).triangles, 0u);
    view.eye_world.setZero();
    ObjectField near = make_field(source, forest(5.0), 1e-30, view);
    const ObjectCounts counts = counts_of(near, view, 1e-30);
    EXPECT_GT(counts.drawn, 1u);
    EXPECT_EQ(counts.left_out, 0u);
}

TEST(ObjectField, RefusesAScatterOfMoreObjectsThanItCanHold) {
    const auto source = test::fractal_hills();
    const View view = view_along({0, 0, 0});
    const auto made =
        ObjectField::create(source, forest(1e6), {.max_error_px = 1e-3, .picture = view}, nullptr);
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().message,
              "tree.obj: a scatter may have at most 2^22 objects in sight, got about 1.67772e+07");
}

}  // namespace object_field_test

// How much of an object's picture its changes of level change, from frame to frame of a slow approach.

namespace slow_approach_test {

constexpr int kSide = 128;
constexpr double kStep = 0.999;   // of the distance, a frame
constexpr double kApart = 0.995;  // of the distances that are compared with their next ones
constexpr double kFov = 0.9;

// Pixels of which a channel differs by more than `more_than` levels.
int count_different(const Image& a, const Image& b, int more_than) {
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        int apart = 0;
        for (std::size_t k = i; k < i + 3; ++k)
            apart = std::max(apart, std::abs(int{a.rgb[k]} - int{b.rgb[k]}));
        count += apart > more_than ? 1 : 0;
    }
    return count;
}

class SlowApproach : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        Result<GlContext> context = GlContext::create();
        if (!context) GTEST_SKIP() << context.error().message;
        context_.emplace(*std::move(context));
    }
    Image draw(TerrainRenderer& renderer, const View& view, const SceneDraws& draws) {
        EXPECT_TRUE(renderer.draw({}, view, draws));
        return renderer.read();
    }
    // The finest level alone.
    Image draw_finest(TerrainRenderer& renderer, const View& view, MeshId mesh) {
        ObjectInstance instance;
        const LocalVec offset = to_local(WorldPos::Zero(), view.eye_world);
        instance.offset_eye = {offset.x(), offset.y(), offset.z()};
        const MeshDraw finest = {mesh, 0, 0, 1};
        return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&finest, 1}});
    }
    static View view_from(const WorldPos& middle, double distance) {
        const WorldPos eye = middle + distance * Eigen::Vector3d(0.8, 0.59, 0.1).normalized();
        return look_at(eye, middle, kFov, kSide, kSide).value();
    }
    std::optional<GlContext> context_;
};

// Prints the largest share of the object's pixels that change from a frame to the next: by its levels alone, by
// levels and motion, and by the motion of the finest mesh. Outlines that move change pixels too.
TEST_P(SlowApproach, LevelsChangeAFewPixelsAFrame) {
    const std::string file = std::string(TERRANE_SOURCE_DIR "/tools/data/") + GetParam();
    const TriangleMesh mesh = read_mesh(file).value();
    ObjectLevels levels = make_object_levels(mesh).value();
    TerrainRenderer renderer = TerrainRenderer::create(*context_, kSide, kSide, {}).value();
    ASSERT_TRUE(upload_levels(levels, {}, renderer));
    const SceneSettings settings;
    Scene scene = Scene::create(settings).value();
    const ModelId model = scene.add_model(levels.model).value();
    ASSERT_TRUE(scene.add(scene.root(), {}, ModelNode{.model = model}));
    const WorldPos middle = 0.5 * (levels.model.bounds.low + levels.model.bounds.high);
    const double radius = 0.5 * (levels.model.bounds.high - levels.model.bounds.low).norm();
    for (std::size_t level = 1; level < levels.model.levels.size(); ++level) {
        // screen errors use the distance from the bounding sphere
        const double pixels = 0.5 * kSide / std::tan(0.5 * kFov);
        const double near = levels.model.levels[level].error_m * pixels;
        double worst_of_levels = 0.0, worst = 0.0, worst_alone = 0.0;
        int compared = 0;
        for (double d = 1.05 * settings.fade_ratio * near; d > 0.95 * near; d *= kApart) {
            const View here = view_from(middle, d + radius),
                       next = view_from(middle, kStep * d + radius);
            const double covered = count_different(draw_finest(renderer, here, levels.model.mesh),
                                                   draw(renderer, here, {}), 0);
            scene.begin_frame(here);
            const Image before = draw(renderer, here, scene.end_frame(1.0));
            // the levels of the next frame, from the place of this one
            const Image changed = draw(renderer, here, scene.end_frame(kStep));
            scene.begin_frame(next);
            const Image after = draw(renderer, next, scene.end_frame(1.0));
            const int alone = count_different(draw_finest(renderer, here, levels.model.mesh),
                                              draw_finest(renderer, next, levels.model.mesh), 8);
            worst_of_levels =
                std::max(worst_of_levels, count_different(before, changed, 8) / covered);
            worst = std::max(worst, count_different(before, after, 8) / covered);
            worst_alone = std::max(worst_alone, alone / covered);
            ++compared;
        }
        std::printf(
            "%s, level %zu, %.0f px: levels change %.2f %% of its pixels, frames %.2f %%, "
            "without levels %.2f %%\n",
            GetParam(), level, 2.0 * radius * pixels / (1.15 * near + radius),
            100.0 * worst_of_levels, 100.0 * worst, 100.0 * worst_alone);
        EXPECT_GT(compared, 50);
        EXPECT_LE(worst_of_levels, 0.02);
    }
}
INSTANTIATE_TEST_SUITE_P(Objects, SlowApproach, ::testing::Values("pine.obj", "boulder.obj"),
                         [](const auto& of) {
                             const std::string file = of.param;
                             return file.substr(0, file.find('.'));
                         });

}  // namespace slow_approach_test
}  // namespace terrane::tools
