// SPDX-License-Identifier: MIT
#include "scene/continuous/rock_levels.h"
#include "scene/culling/random_views.h"
#include "scene/objects/random_scene.h"

#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::test::continuous_levels {
namespace {

using Triangle = TriangleMesh::Triangle;

constexpr double kRounding = 1e-4;

const RockLevels& rock() {
    static const RockLevels levels = make_rock_levels(4, 1);
    return levels;
}

// The coarsest level within an error, by looking at every one.
std::size_t count_within(const ProgressiveMesh& mesh, double error_m) {
    std::size_t count = mesh.step_triangle_counts()[0];
    for (std::size_t i = 0; i < mesh.step_errors_m().size(); ++i) {
        if (mesh.step_errors_m()[i] <= error_m) count = mesh.step_triangle_counts()[i];
    }
    return count;
}

bool are_equal(std::span<const Triangle> a, std::span<const Triangle> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

// The object that an instance places; one that is farther than rounding from all others is a failure.
const PlacedObject& placed_as(const ObjectInstance& instance, const View& view,
                              const std::vector<PlacedObject>& objects) {
    const auto& [x, y, z] = instance.offset_eye;
    const WorldPos at = view.eye_world + Eigen::Vector3f(x, y, z).cast<double>();
    const auto apart = [&](const PlacedObject& o) { return (o.position_world - at).norm(); };
    const auto nearest = std::min_element(
        objects.begin(), objects.end(),
        [&](const PlacedObject& a, const PlacedObject& b) { return apart(a) < apart(b); });
    EXPECT_LT(apart(*nearest), 0.01);
    return *nearest;
}

TEST(ContinuousLevels, AreTheCoarsestWithinTheThreshold) {
    const ObjectModel& model = rock().model;
    ProgressiveMesh fresh = model.continuous->share();
    int compared = 0, partly = 0, impostors = 0;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene scene = Scene::create({.fade_ratio = random.between(1.0, 2.0)}).value();
        const ModelId id = scene.add_model(model).value();
        std::vector<PlacedObject> objects;
        for (int i = 0; i < 10; ++i) objects.push_back(random_object(random, 30.0));
        ASSERT_TRUE(scene.add_group(id, objects));
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, random.between(0.0, 60.0) * random.direction());
            const double threshold = std::exp2(random.between(-4.0, 6.0));
            scene.begin_frame(view);
            const SceneDraws draws = scene.end_frame(threshold);
            EXPECT_TRUE(draws.meshes.empty()) << "all may have levels of their own";
            for (const StreamedDraw& draw : draws.streamed) {
                const ObjectInstance& instance = draws.instances[draw.instance];
                const double most_error =
                    threshold / factor_of(view, model, placed_as(instance, view, objects));
                ASSERT_LE(draw.triangles.size(),
                          count_within(*model.continuous, most_error * (1.0 - kRounding)));
                ASSERT_GE(draw.triangles.size(),
                          count_within(*model.continuous, most_error * (1.0 + kRounding)));
                fresh.set_triangle_count(draw.triangles.size());
                ASSERT_TRUE(are_equal(draw.triangles, fresh.triangles()));
                ASSERT_GT(instance.coverage, 0.0f);
                ASSERT_LE(instance.coverage, 1.0f);
                ++compared;
                partly += instance.coverage < 1.0f ? 1 : 0;
            }
            for (const ImpostorDraw& draw : draws.impostors)
                impostors += static_cast<int>(draw.instance_count);
            ASSERT_EQ(scene.counts().continuous, draws.streamed.size());
        }
    }
    EXPECT_GT(compared, 200);
    EXPECT_GT(partly, 10) << "with an impostor that fades in";
    EXPECT_GT(impostors, 50);
}

TEST(ContinuousLevels, DrawNoMoreTrianglesThanTheDemandsAboveTheThreshold) {
    const std::vector<ObjectModel> rocks = {rock().model, make_rock_levels(3, 2, false).model,
                                            make_rock_levels(3, 3, true, false).model};
    int frames = 0, close = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        SceneSettings settings;
        settings.fade_ratio = random.below(3) == 0 ? 1.0 : random.between(1.0, 2.0);
        settings.most_continuous = static_cast<std::size_t>(random.below(30));
        Scene scene = Scene::create(settings).value();
        for (ObjectModel model : rocks) {
            if (random.below(4) == 0)
                model.absence_error_m = std::numeric_limits<double>::infinity();
            const ModelId id = scene.add_model(model).value();
            std::vector<PlacedObject> objects;
            for (int i = random.below(60); i > 0; --i)
                objects.push_back(random_object(random, 60.0));
            ASSERT_TRUE(scene.add_group(id, objects));
        }
        const ModelId tree = scene.add_model(tree_model()).value();
        ASSERT_TRUE(scene.add_group(tree, spread_objects(random, 50, 100.0)));
        for (int frame = 0; frame < 30; ++frame) {
            const View view = random_view(random, random.between(0.0, 90.0) * random.direction());
            const std::span<const TriangleDemand> demands =
                scene.begin_frame(view, random.below(2) == 0 ? 0.0 : 0.02);
            // Also at the ends of bins, where a demand is just granted or just not.
            const double threshold = !demands.empty() && random.below(2) == 0
                                         ? demands[static_cast<std::size_t>(random.below(
                                                       static_cast<int>(demands.size())))]
                                               .threshold_px
                                         : std::exp2(random.between(-5.0, 10.0));
            const std::size_t most = granted(demands, std::max(threshold, 0.02));
            const SceneDraws draws = scene.end_frame(std::max(threshold, 0.02));
            ASSERT_LE(scene.counts().triangles, most) << threshold;
            ASSERT_LE(draws.streamed.size(), settings.most_continuous);
            std::size_t streamed = 0;
            for (const StreamedDraw& draw : draws.streamed) streamed += draw.triangles.size();
            ASSERT_LE(streamed, scene.counts().triangles);
            if (2 * streamed <= scene.counts().triangles) continue;
            ++frames;
            close += scene.counts().triangles >= most - most / 8 ? 1 : 0;
        }
    }
    EXPECT_GT(frames, 200);
    EXPECT_GT(close, frames / 2) << "the bound must not be far above";
}

TEST(ContinuousLevels, OfASmallStepDifferInFewTriangles) {
    Scene scene = Scene::create({}).value();
    const ModelId id = scene.add_model(rock().model).value();
    const PlacedObject placed;
    ASSERT_TRUE(scene.add_group(id, {&placed, 1}));
    std::vector<Triangle> before;
    std::size_t drawn = 0, different = 0;
    constexpr double kStep = 0.999;
    for (double distance = 40.0; distance > 1.5; distance *= kStep) {
        const View view =
            look_at(WorldPos(0.0, -distance, 0.0), WorldPos::Zero(), 1.0, 1280, 720).value();
        scene.begin_frame(view);
        const SceneDraws draws = scene.end_frame(1.0);
        ASSERT_EQ(draws.streamed.size(), 1u) << distance;
        const std::span<const Triangle> now = draws.streamed[0].triangles;
        if (!before.empty()) {
            ASSERT_GE(now.size(), before.size());
            const std::size_t come = now.size() - before.size();
            std::size_t changed = come;
            for (std::size_t i = 0; i < before.size(); ++i)
                changed += before[i] != now[i] ? 1u : 0u;
            // A contraction takes two triangles away and changes about four more.
            ASSERT_LE(changed, 10 * come) << distance;
            different += changed;
        }
        drawn += now.size();
        before.assign(now.begin(), now.end());
    }
    EXPECT_GT(before.size(), 700u);
    EXPECT_LE(different, drawn / 100) << "on average";
}

// How far any corner of some triangles is from the surface of others.
double farthest(std::span<const Triangle> from, std::span<const Triangle> to,
                const std::vector<Eigen::Vector3d>& positions) {
    double most = 0.0;
    for (const Triangle& t : from) {
        for (const std::uint32_t v : t) {
            double least = std::numeric_limits<double>::infinity();
            for (const Triangle& other : to) {
                const Eigen::Vector3d nearest = project_to_triangle(
                    positions[other[0]], positions[other[1]], positions[other[2]])(positions[v]);
                least = std::min(least, (nearest - positions[v]).squaredNorm());
            }
            most = std::max(most, least);
        }
    }
    return std::sqrt(most);
}

TEST(ContinuousLevels, BeginAndEndWithinTheErrorsOfTheLevels) {
    const RockLevels levels = make_rock_levels(3, 5, false);
    const std::vector<Eigen::Vector3d>& positions = levels.model.continuous->finest().positions;
    constexpr double kThreshold = 1.5;
    // Levels switch at once, so that the discrete ones are not between two.
    Scene scene = Scene::create({.fade_ratio = 1.0, .most_continuous = 1}).value();
    const ModelId id = scene.add_model(levels.model).value();
    std::vector<PlacedObject> objects(2);
    objects[0].position_world = {-6.0, 0.0, 0.0};
    objects[1].position_world = {6.0, 0.0, 0.0};
    ASSERT_TRUE(scene.add_group(id, objects));
    std::vector<Triangle> before[2];
    bool was_continuous[2] = {false, false};
    int changes = 0;
    for (int frame = 0; frame < 60; ++frame) {
        // to and fro between the two
        const double x = 3.0 * (std::abs(frame % 30 - 15.0) / 7.5 - 1.0);
        const View view =
            look_at(WorldPos(x, -14.0, 0.5), WorldPos(x, 0.0, 0.0), 1.2, 1280, 720).value();
        scene.begin_frame(view);
        const SceneDraws draws = scene.end_frame(kThreshold);
        ASSERT_EQ(draws.streamed.size(), 1u);
        std::vector<Triangle> now[2];
        bool is_continuous[2] = {false, false};
        const auto which = [&](std::uint32_t instance) {
            return &placed_as(draws.instances[instance], view, objects) == &objects[1] ? 1 : 0;
        };
        for (const StreamedDraw& draw : draws.streamed) {
            now[which(draw.instance)].assign(draw.triangles.begin(), draw.triangles.end());
            is_continuous[which(draw.instance)] = true;
        }
        for (const MeshDraw& draw : draws.meshes) {
            for (std::uint32_t i = 0; i < draw.instance_count; ++i)
                now[which(draw.first_instance + i)] = levels.triangles[draw.level];
        }
        for (std::size_t i = 0; i < 2; ++i) {
            ASSERT_FALSE(now[i].empty());
            if (frame > 0 && is_continuous[i] != was_continuous[i]) {
                ++changes;
                const double moved = std::max(farthest(before[i], now[i], positions),
                                              farthest(now[i], before[i], positions));
                const double error_m = kThreshold / factor_of(view, levels.model, objects[i]);
                // the level before was within the error of a view that is a step away
                EXPECT_LE(moved, 2.05 * error_m) << "frame " << frame << " object " << i;
            }
            before[i] = now[i];
            was_continuous[i] = is_continuous[i];
        }
    }
    EXPECT_GE(changes, 6);
    EXPECT_LE(changes, 10) << "twice an object each time that the eye passes";
}

}  // namespace
}  // namespace terrane::test::continuous_levels
