// SPDX-License-Identifier: MIT
#include "objects/continuous_levels.h"

#include "scene/random_scene.h"
#include "scene/scene_cases.h"
#include "support/meshes.h"

#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

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
        ASSERT_TRUE(add_instances(scene, id, objects));
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, random.between(0.0, 60.0) * random.direction());
            const double threshold = std::exp2(random.between(-4.0, 6.0));
            scene.begin_frame(view);
            const SceneDraws draws = scene.end_frame(threshold);
            EXPECT_TRUE(draws.meshes.empty()) << "all may have levels of their own";
            for (const StreamedDraw& draw : draws.streamed) {
                const ObjectInstance& instance = draws.instances[draw.instance];
                const std::size_t object = object_of(instance, view, objects);
                ASSERT_LT(object, objects.size());
                const double most_error = threshold / factor_of(view, model, objects[object]);
                ASSERT_LE(draw.triangles.size(),
                          count_within(*model.continuous, most_error * (1.0 - kRounding)));
                ASSERT_GE(draw.triangles.size(),
                          count_within(*model.continuous, most_error * (1.0 + kRounding)));
                fresh.set_triangle_count(draw.triangles.size());
                ASSERT_TRUE(std::ranges::equal(draw.triangles, fresh.triangles()));
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
            ASSERT_TRUE(add_instances(scene, id, objects));
        }
        const ModelId tree = scene.add_model(tree_model()).value();
        ASSERT_TRUE(add_instances(scene, tree, spread_objects(random, 50, 100.0)));
        for (int frame = 0; frame < 30; ++frame) {
            const View view = random_view(random, random.between(0.0, 90.0) * random.direction());
            const std::span<const TriangleDemand> demands =
                scene.begin_frame(view, random.below(2) == 0 ? 0.0 : 0.02);
            const double threshold = std::max(random_threshold(random, demands, -5.0, 10.0), 0.02);
            const std::size_t most = granted(demands, threshold);
            const SceneDraws draws = scene.end_frame(threshold);
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
    ASSERT_TRUE(add_instances(scene, id, {&placed, 1}));
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

TEST(ContinuousLevels, BeginAndEndWithinTheErrorsOfTheLevels) {
    const RockLevels levels = make_rock_levels(3, 5, false);
    const std::vector<Eigen::Vector3d>& positions = levels.model.continuous->finest().positions;
    constexpr double kThreshold = 1.5;
    // Levels switch at once, so that the discrete ones are not between two.
    Scene scene = Scene::create({.fade_ratio = 1.0, .most_continuous = 1}).value();
    const ModelId id = scene.add_model(levels.model).value();
    std::vector<PlacedObject> objects(2);
    objects[0].position = {-6.0, 0.0, 0.0};
    objects[1].position = {6.0, 0.0, 0.0};
    ASSERT_TRUE(add_instances(scene, id, objects));
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
            return object_of(draws.instances[instance], view, objects);
        };
        for (const StreamedDraw& draw : draws.streamed) {
            ASSERT_LT(which(draw.instance), objects.size());
            now[which(draw.instance)].assign(draw.triangles.begin(), draw.triangles.end());
            is_continuous[which(draw.instance)] = true;
        }
        for (const MeshDraw& draw : draws.meshes) {
            for (std::uint32_t i = 0; i < draw.instance_count; ++i) {
                ASSERT_LT(which(draw.first_instance + i), objects.size());
                now[which(draw.first_instance + i)] = levels.triangles[draw.level];
            }
        }
        for (std::size_t i = 0; i < 2; ++i) {
            ASSERT_FALSE(now[i].empty());
            if (frame > 0 && is_continuous[i] != was_continuous[i]) {
                ++changes;
                // of corners from the other's surface
                const double moved = measured_distance(positions, before[i], now[i], 1);
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

namespace terrane::test::continuous_limits {
namespace {

const ObjectModel& rock() {
    static const ObjectModel model = make_rock_levels(3, 1).model;
    return model;
}

Scene make_scene(std::size_t most, const ObjectModel& model, std::uint64_t seed, int count) {
    Scene scene = Scene::create({.most_continuous = most}).value();
    const ModelId id = scene.add_model(model).value();
    Random random(seed);
    std::vector<PlacedObject> objects;
    for (int i = 0; i < count; ++i) objects.push_back(random_object(random, 20.0));
    EXPECT_TRUE(add_instances(scene, id, objects));
    return scene;
}

TEST(ContinuousLimits, WithoutAnyTheSceneIsAsWithoutContinuousModels) {
    ObjectModel discrete = rock();
    discrete.continuous = nullptr;
    Scene none = make_scene(0, rock(), 1, 40), plain = make_scene(16, discrete, 1, 40);
    Random random(2);
    for (int frame = 0; frame < 50; ++frame) {
        const View view = random_view(random, random.between(0.0, 40.0) * random.direction());
        const std::span<const TriangleDemand> a = none.begin_frame(view),
                                              b = plain.begin_frame(view);
        ASSERT_EQ(granted(a, 0.5), granted(b, 0.5));
        const SceneDraws of_none = none.end_frame(0.5);
        EXPECT_TRUE(of_none.streamed.empty());
        ASSERT_EQ(bits_of(of_none), bits_of(plain.end_frame(0.5)));
    }
}

TEST(ContinuousLimits, AnyNumberMayBeNear) {
    Scene all = make_scene(std::numeric_limits<std::size_t>::max(), rock(), 3, 200);
    const View view = look_at(WorldPos(0, -40, 0), WorldPos(0, 0, 0), 1.0, 1280, 720).value();
    all.begin_frame(view);
    const SceneDraws draws = all.end_frame(0.25);
    EXPECT_TRUE(draws.meshes.empty());
    EXPECT_GT(draws.streamed.size(), 100u);
}

TEST(ContinuousLimits, AnEyeInTheObjectSeesItsFinestNeededLevel) {
    Scene scene = Scene::create({}).value();
    const ModelId id = scene.add_model(rock()).value();
    View view;
    scene.begin_frame(view);
    EXPECT_TRUE(scene.end_frame(1.0).streamed.empty()) << "no objects";
    const PlacedObject placed;
    ASSERT_TRUE(add_instances(scene, id, {&placed, 1}));
    scene.begin_frame(view);
    const SceneDraws draws = scene.end_frame(1e-6);
    ASSERT_EQ(draws.streamed.size(), 1u);
    EXPECT_TRUE(draws.meshes.empty());
    // but for contractions without an error
    EXPECT_GT(draws.streamed[0].triangles.size(), rock().levels[0].triangles / 2);
    EXPECT_TRUE(scene.end_frame(std::numeric_limits<double>::infinity()).instances.empty());
    scene.begin_frame(view, std::numeric_limits<double>::infinity());
    EXPECT_TRUE(scene.end_frame(1.0).streamed.empty());
}

TEST(ContinuousLimits, InvalidViewsDrawNothingAndChangeNothing) {
    Scene scene = make_scene(4, rock(), 5, 30), undisturbed = make_scene(4, rock(), 5, 30);
    Random random(6);
    for (int frame = 0; frame < 20; ++frame) {
        View invalid;
        invalid.eye_world.x() = std::numeric_limits<double>::quiet_NaN();
        EXPECT_TRUE(scene.begin_frame(invalid).empty());
        EXPECT_TRUE(scene.end_frame(1.0).streamed.empty());
        EXPECT_EQ(scene.counts().continuous, 0u);
        const View view = random_view(random, 5.0 * random.direction());
        scene.begin_frame(view);
        undisturbed.begin_frame(view);
        ASSERT_EQ(bits_of(scene.end_frame(0.5)), bits_of(undisturbed.end_frame(0.5)));
    }
}

TEST(ContinuousLimits, LevelsDoNotDependOnShadows) {
    Scene with = make_scene(4, rock(), 7, 60), without = make_scene(4, rock(), 7, 60);
    Random random(8);
    std::size_t casters = 0;
    for (int frame = 0; frame < 50; ++frame) {
        const View view = random_view(random, random.between(0.0, 30.0) * random.direction());
        const SunShadows shadows = {.sun_direction = random.direction(), .distance = 100.0};
        with.begin_frame(view, 0.0, shadows);
        without.begin_frame(view);
        const SceneDraws a = with.end_frame(0.5), b = without.end_frame(0.5);
        casters += with.counts().casters;
        SceneDraws seen = a;
        seen.instances = a.instances.first(b.instances.size());
        ASSERT_EQ(bits_of(seen), bits_of(b));
    }
    EXPECT_GT(casters, 100u);
}

TEST(ContinuousLimits, GroupsThatComeAndGoLeaveNoLevels) {
    Scene scene = make_scene(8, rock(), 9, 20), fresh = make_scene(8, rock(), 9, 20);
    Random random(10);
    for (int frame = 0; frame < 40; ++frame) {
        const View view = random_view(random, 10.0 * random.direction());
        std::vector<PlacedObject> passing;
        for (int i = 0; i < 5; ++i) passing.push_back(random_object(random, 300.0));
        const NodeId extra = add_instances(scene, ModelId{0}, passing).value();
        scene.begin_frame(view);
        if (frame % 3 == 0) scene.end_frame(0.5);
        scene.remove(extra);
        EXPECT_TRUE(scene.end_frame(0.5).streamed.empty()) << "the frame has ended";
    }
    // which are near is decided anew where all of the others are far away
    const View away = look_at(WorldPos(1e6, 0, 0), WorldPos(2e6, 0, 0), 1.0, 1280, 720).value();
    const View view = look_at(WorldPos(0, -30, 0), WorldPos(0, 0, 0), 1.0, 1280, 720).value();
    for (Scene* each : {&scene, &fresh}) {
        each->begin_frame(away);
        each->begin_frame(view);
    }
    EXPECT_EQ(bits_of(scene.end_frame(0.5)), bits_of(fresh.end_frame(0.5)));
}

TEST(ContinuousLimits, ModelsThatDoNotFitAreRefused) {
    Scene scene = Scene::create({}).value();
    const auto message = [&](const ObjectModel& model) {
        const Result<ModelId> made = scene.add_model(model);
        return made ? std::string() : made.error().message;
    };
    ObjectModel model = rock();
    model.levels[0].triangles += 1;
    EXPECT_EQ(message(model),
              "continuous must have the triangles of the finest level, a mesh, got 1280");
    model = rock();
    model.levels.push_back(model.levels.back());
    model.levels.back() = {.error_m = 2.0 * model.levels.back().error_m, .triangles = 1};
    EXPECT_EQ(message(model),
              "with continuous no mesh may come after an impostor, got one in level 5");
    EXPECT_EQ(message(rock()), "");
}

}  // namespace
}  // namespace terrane::test::continuous_limits

namespace terrane::test::near_objects {
namespace {

using internal::NearObject;
using internal::NearObjects;
using internal::ObjectKey;

std::set<ObjectKey> select(NearObjects& near, const std::map<ObjectKey, float>& candidates) {
    near.clear();
    std::size_t place = 0;
    for (const auto& [key, factor] : candidates)
        near.add({.key = key, .model = 0, .place = place++, .log2_factor = factor});
    near.select();
    std::set<ObjectKey> keys;
    std::size_t least_place = 0;
    for (const NearObject& object : near.objects()) {
        EXPECT_GE(object.place, least_place) << "in the order of places";
        least_place = object.place + 1;
        EXPECT_EQ(candidates.at(object.key), object.log2_factor);
        keys.insert(object.key);
    }
    return keys;
}

TEST(NearObjects, AreTheNearestOfRandomCandidatesAndThoseThatStay) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const auto most = static_cast<std::size_t>(1 + random.below(20));
        NearObjects near(most);
        std::set<ObjectKey> before;
        for (int frame = 0; frame < 30; ++frame) {
            std::map<ObjectKey, float> candidates;
            for (int i = random.below(60); i > 0; --i) {
                // with ties
                candidates[{static_cast<std::uint64_t>(random.below(8)),
                            static_cast<std::uint32_t>(random.below(8))}] =
                    0.25f * static_cast<float>(random.below(20));
            }
            // slowly: sort all
            std::vector<std::pair<float, ObjectKey>> ranked;
            for (const auto& [key, factor] : candidates)
                ranked.emplace_back(before.contains(key) ? -factor - 0.169925f : -factor, key);
            std::sort(ranked.begin(), ranked.end());
            ranked.resize(std::min(ranked.size(), most));
            std::set<ObjectKey> expected;
            for (const auto& [nearness, key] : ranked) expected.insert(key);
            before = select(near, candidates);
            ASSERT_EQ(before, expected);
        }
    }
}

TEST(NearObjects, DoNotTakeTurnsWhileTheyAreNearlyEqual) {
    NearObjects near(1);
    const ObjectKey first = {1, 0}, second = {1, 1};
    EXPECT_EQ(select(near, {{first, 3.0f}, {second, 2.9f}}), std::set{first});
    for (int frame = 0; frame < 10; ++frame) {
        const float apart = frame % 2 == 0 ? 0.15f : -0.15f;  // a tenth
        EXPECT_EQ(select(near, {{first, 3.0f}, {second, 3.0f + apart}}), std::set{first});
    }
    EXPECT_EQ(select(near, {{first, 3.0f}, {second, 3.2f}}), std::set{second});
    EXPECT_EQ(select(near, {{first, 3.1f}, {second, 3.0f}}), std::set{second});
}

TEST(NearObjects, AreAllWhereThatManyMayBeAndTheFirstWhereAllAreEqual) {
    NearObjects all(std::numeric_limits<std::size_t>::max());
    EXPECT_TRUE(select(all, {}).empty());
    EXPECT_EQ(select(all, {{{1, 0}, 1.0f}, {{1, 5}, 1.0f}, {{2, 0}, -3.0f}}).size(), 3u);
    NearObjects two(2);
    EXPECT_EQ(select(two, {{{4, 0}, 1.0f}, {{5, 5}, 1.0f}, {{6, 0}, 1.0f}}),
              (std::set<ObjectKey>{{4, 0}, {5, 5}}));
}

}  // namespace
}  // namespace terrane::test::near_objects
