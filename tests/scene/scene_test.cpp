// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"
#include "scene/scene_cases.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>

namespace terrane::test::scene {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Made {
    Scene scene;
    std::vector<ObjectModel> models;
    std::vector<std::vector<PlacedObject>> groups;
    std::vector<std::uint32_t> model_of;  // [groups]
    std::vector<NodeId> ids;              // [groups]
    double fade_ratio;
};

Made make_random(Random& random) {
    SceneSettings settings;
    settings.fade_ratio = random.below(3) == 0 ? 1.0 : random.between(1.0, 2.0);
    settings.cull_test = random.below(2) == 0 ? CullTest::planes : CullTest::exact;
    Made made = {Scene::create(settings).value(), {}, {}, {}, {}, settings.fade_ratio};
    const int models = 1 + random.below(4);
    for (int i = 0; i < models; ++i) {
        made.models.push_back(random_model(random, static_cast<std::uint32_t>(i)));
        EXPECT_TRUE(made.scene.add_model(made.models.back()).has_value());
    }
    const int groups = random.below(5);
    for (int i = 0; i < groups; ++i) {
        made.model_of.push_back(static_cast<std::uint32_t>(random.below(models)));
        std::vector<PlacedObject> objects;
        for (int k = random.below(700); k > 0; --k) objects.push_back(random_object(random, 500.0));
        made.ids.push_back(
            add_instances(made.scene, ModelId{made.model_of.back()}, objects).value());
        made.groups.push_back(std::move(objects));
    }
    return made;
}

TEST(Scene, DrawsNoMoreTrianglesThanItsDemandsAboveTheThreshold) {
    int frames = 0, exact = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Made made = make_random(random);
        for (int frame = 0; frame < 40; ++frame) {
            const View view = random_view(random, random.between(0.0, 600.0) * random.direction());
            const std::span<const TriangleDemand> demands = made.scene.begin_frame(view);
            const double threshold = random_threshold(random, demands, -8.0, 12.0);
            const std::size_t most = granted(demands, threshold);
            const SceneDraws draws = made.scene.end_frame(threshold);
            ASSERT_LE(made.scene.counts().triangles, most) << threshold;
            std::size_t triangles = 0, instances = 0;
            for (const MeshDraw& draw : draws.meshes) {
                const ObjectModel& model = made.models[static_cast<std::size_t>(draw.mesh)];
                triangles += std::size_t{draw.instance_count} * model.levels[draw.level].triangles;
                instances += draw.instance_count;
            }
            for (const ImpostorDraw& draw : draws.impostors) {
                triangles += 2 * std::size_t{draw.instance_count};
                instances += draw.instance_count;
            }
            ASSERT_EQ(triangles, made.scene.counts().triangles);
            ASSERT_EQ(instances, draws.instances.size());
            ++frames;
            exact += triangles > 0 && triangles >= most - most / 10 ? 1 : 0;
        }
    }
    EXPECT_GT(exact, frames / 20) << "the bound must not be far above";
}

// What is drawn of each object, found by its position.
using Drawn = std::map<std::size_t, std::vector<std::pair<std::size_t, float>>>;
Drawn drawn_of(const Made& made, std::size_t group, const SceneDraws& draws, const View& view) {
    Drawn drawn;
    const auto add = [&](const ObjectInstance& instance, std::size_t level) {
        const std::size_t nearest = object_of(instance, view, made.groups[group]);
        EXPECT_LT(nearest, made.groups[group].size());
        if (instance.coverage <= 1.0f) {
            drawn[nearest].push_back({level, instance.coverage});
            return;
        }
        // a morph is the two levels in one
        EXPECT_TRUE(made.models[made.model_of[group]].levels[level].morphs);
        const float share = 2.0f - instance.coverage;
        drawn[nearest].push_back({level, share});
        drawn[nearest].push_back({level + 1, share - 1.0f});
    };
    const ObjectModel& model = made.models[made.model_of[group]];
    for (const MeshDraw& draw : draws.meshes) {
        for (std::uint32_t i = 0; i < draw.instance_count; ++i)
            add(draws.instances[draw.first_instance + i], draw.level);
    }
    for (const ImpostorDraw& draw : draws.impostors) {
        for (std::uint32_t i = 0; i < draw.instance_count; ++i)
            add(draws.instances[draw.first_instance + i], model.levels.size() - 1);
    }
    return drawn;
}

TEST(Scene, DrawsTheCoarsestLevelsWithinTheThresholdOfEveryObjectInView) {
    constexpr double kRounding = 1e-4;
    int fades = 0, single = 0, left_out = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Made made = make_random(random);
        // one group, so that objects are found by their position
        while (made.groups.size() > 1) {
            made.scene.remove(made.ids.back());
            made.groups.pop_back();
            made.ids.pop_back();
        }
        if (made.groups.empty() || made.groups[0].empty()) continue;
        const ObjectModel& model = made.models[made.model_of[0]];
        for (int frame = 0; frame < 5; ++frame) {
            const View view = random_view(random, random.between(0.0, 600.0) * random.direction());
            const double threshold = std::exp2(random.between(-6.0, 10.0));
            made.scene.begin_frame(view);
            const Drawn drawn = drawn_of(made, 0, made.scene.end_frame(threshold), view);
            const ViewVolume volume(view);
            for (std::size_t i = 0; i < made.groups[0].size(); ++i) {
                const PlacedObject& object = made.groups[0][i];
                const double factor = factor_of(view, model, object);
                const auto error_px = [&](std::size_t level) {
                    return factor * (level == model.levels.size() ? model.absence_error_m
                                                                  : model.levels[level].error_m);
                };
                const auto found = drawn.find(i);
                const OrientedBox box =
                    transform({rotation_of(object).toRotationMatrix(), object.position},
                              static_cast<double>(object.scale), model.bounds);
                if (found == drawn.end()) {
                    const bool is_needed =
                        error_px(model.levels.size()) > threshold * (1.0 + kRounding);
                    ASSERT_FALSE(is_needed && volume.meets(box)) << "object " << i;
                    ++left_out;
                    continue;
                }
                const auto& levels = found->second;
                ASSERT_LE(levels.size(), 2u);
                for (const auto& [level, coverage] : levels) {
                    // the finest level is drawn whatever its error
                    if (level > 0) {
                        ASSERT_LE(error_px(level), threshold * (1.0 + kRounding));
                    }
                }
                const std::size_t coarsest = std::max(levels.front().first, levels.back().first);
                ASSERT_GT(error_px(coarsest + 1) * made.fade_ratio, threshold * (1.0 - kRounding));
                if (levels.size() == 2) {
                    ++fades;
                    ASSERT_EQ(std::abs(static_cast<int>(levels[0].first) -
                                       static_cast<int>(levels[1].first)),
                              1);
                    const float finer = std::max(levels[0].second, levels[1].second);
                    const float coarser = std::min(levels[0].second, levels[1].second);
                    ASSERT_EQ(coarser, finer - 1.0f) << "together they cover every pixel once";
                } else if (levels[0].second == 1.0f) {
                    ++single;
                    // a coarser level would have been drawn in its place
                    ASSERT_GT(error_px(coarsest + 1), threshold * (1.0 - kRounding));
                }
            }
        }
    }
    EXPECT_GT(fades, 100);
    EXPECT_GT(single, 1000);
    EXPECT_GT(left_out, 1000);
}

TEST(Scene, ASlowApproachChangesCoverageByLittleAndNeverSwapsALevelAtOnce) {
    Scene scene = Scene::create({.fade_ratio = 1.3}).value();
    const ModelId model = scene.add_model(tree_model()).value();
    const PlacedObject tree;
    ASSERT_TRUE(add_instances(scene, model, {&tree, 1}).has_value());
    std::map<std::uint32_t, float> before;  // pixels' share of each level
    int changes = 0;
    for (double distance = 20'000.0; distance > 10.0; distance *= 0.999) {
        View view;
        view.eye_world = {0.0, -distance, 4.0};
        scene.begin_frame(view);
        const SceneDraws draws = scene.end_frame(1.0);
        std::map<std::uint32_t, float> now;
        const auto add = [&](std::uint32_t level, const ObjectInstance& instance) {
            now[level] = instance.coverage > 0.0f ? instance.coverage : -instance.coverage;
        };
        for (const MeshDraw& draw : draws.meshes)
            add(draw.level, draws.instances[draw.first_instance]);
        for (const ImpostorDraw& draw : draws.impostors)
            add(3, draws.instances[draw.first_instance]);
        for (std::uint32_t level = 0; level < 4; ++level) {
            const float change = std::abs(now[level] - before[level]);
            ASSERT_LT(change, 0.01f) << distance << " level " << level;
            changes += change > 0.0f ? 1 : 0;
        }
        before = now;
    }
    EXPECT_GT(changes, 100);
    EXPECT_EQ(before[0], 1.0f) << "near, the finest level alone is drawn";
}

TEST(Scene, AFrameDoesNotDependOnGroupsAndFramesThatAreGone) {
    int compared = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Made used = make_random(random);
        Random again(seed);
        Made fresh = make_random(again);
        std::vector<PlacedObject> passing;
        for (int i = 0; i < 300; ++i) passing.push_back(random_object(random, 300.0));
        for (int frame = 0; frame < 10; ++frame) {
            const NodeId extra = add_instances(used.scene, ModelId{0}, passing).value();
            used.scene.begin_frame(random_view(random, WorldPos(0, 0, 0)));
            used.scene.end_frame(1.0);
            used.scene.remove(extra);
            const View view = random_view(random, WorldPos(0, 0, 0));
            ASSERT_TRUE(are_equal(used.scene.begin_frame(view), fresh.scene.begin_frame(view)));
            const SceneDraws expected = fresh.scene.end_frame(2.0);
            ASSERT_EQ(bits_of(used.scene.end_frame(2.0)), bits_of(expected));
            compared += expected.instances.empty() ? 0 : 1;
        }
    }
    EXPECT_GT(compared, 40) << "of 200 frames";
}

TEST(Scene, ManyGroupsThatComeAndGoLeaveWhatAFreshSceneHas) {
    int compared = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene used = Scene::create({}).value();
        const ModelId model = used.add_model(tree_model()).value();
        std::map<NodeId, std::vector<PlacedObject>> alive;
        for (int step = 0; step < 1500; ++step) {
            if (random.below(3) > 0 || alive.empty()) {
                std::vector<PlacedObject> objects;
                for (int i = 1 + random.below(4); i > 0; --i)
                    objects.push_back(random_object(random, 400.0));
                alive[add_instances(used, model, objects).value()] = objects;
            } else {
                const auto gone =
                    std::next(alive.begin(), random.below(static_cast<int>(alive.size())));
                used.remove(gone->first);
                alive.erase(gone);
            }
            if (step % 50 != 0) continue;
            Scene fresh = Scene::create({}).value();
            ASSERT_TRUE(fresh.add_model(tree_model()).has_value());
            for (const auto& [id, objects] : alive)
                ASSERT_TRUE(add_instances(fresh, model, objects).has_value());
            const View view = random_view(random, WorldPos(0, 0, 0));
            used.begin_frame(view);
            fresh.begin_frame(view);
            const SceneDraws expected = fresh.end_frame(0.5);
            ASSERT_EQ(bits_of(used.end_frame(0.5)), bits_of(expected));
            compared += expected.instances.empty() ? 0 : 1;
        }
        EXPECT_GT(alive.size(), 300u);
    }
    EXPECT_GT(compared, 40) << "of 180 frames";
}

TEST(Scene, ALeastThresholdLeavesOutWhatNoFrameDrawsAndNothingElse) {
    int compared = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Made made = make_random(random);
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, random.between(0.0, 600.0) * random.direction());
            const double least = std::exp2(random.between(-3.0, 6.0));
            const double threshold = least * random.between(1.0, 4.0);
            made.scene.begin_frame(view);
            const std::vector<std::byte> all = bits_of(made.scene.end_frame(threshold));
            const SceneCounts counts = made.scene.counts();
            const std::span<const TriangleDemand> demands = made.scene.begin_frame(view, least);
            const std::size_t most = granted(demands, threshold);
            ASSERT_EQ(bits_of(made.scene.end_frame(threshold)), all);
            ASSERT_LE(made.scene.counts().triangles, most);
            ASSERT_EQ(made.scene.counts().triangles, counts.triangles);
            ASSERT_EQ(made.scene.counts().drawn, counts.drawn);
            compared += all.empty() ? 0 : 1;
            // a smaller threshold than the least one counts as that
            made.scene.begin_frame(view, least);
            made.scene.end_frame(0.5 * least);
            const std::size_t drawn = made.scene.counts().drawn;
            made.scene.begin_frame(view);
            made.scene.end_frame(least);
            ASSERT_EQ(made.scene.counts().drawn, drawn);
        }
    }
    EXPECT_GT(compared, 40) << "of 400 frames";
}

TEST(Scene, GroupsThatChangeWithinAFrameEndIt) {
    Scene scene = Scene::create({}).value();
    const ModelId model = scene.add_model(tree_model()).value();
    const PlacedObject tree = {.position = {0, 30, 0}};
    const NodeId first = add_instances(scene, model, {&tree, 1}).value();
    const NodeId second = add_instances(scene, model, {&tree, 1}).value();
    scene.begin_frame(View{});
    scene.remove(first);
    EXPECT_TRUE(scene.end_frame(1.0).instances.empty());
    scene.begin_frame(View{});
    ASSERT_TRUE(add_instances(scene, model, {&tree, 1}).has_value());
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 1u) << "what came later is in the next frame";
    scene.remove(second);
    scene.begin_frame(View{});
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 1u);
}

TEST(Scene, EmptyOnesAndInvalidViewsDrawNothing) {
    Scene scene = Scene::create({}).value();
    EXPECT_TRUE(scene.begin_frame(View{}).empty());
    EXPECT_TRUE(scene.end_frame(1.0).instances.empty());
    const ModelId model = scene.add_model(tree_model()).value();
    EXPECT_TRUE(add_instances(scene, model, {}).has_value());
    EXPECT_TRUE(scene.begin_frame(View{}).empty());
    const PlacedObject tree = {.position = {0, 30, 0}};
    const NodeId group = add_instances(scene, model, {&tree, 1}).value();
    EXPECT_FALSE(scene.begin_frame(View{}).empty());
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 1u);
    EXPECT_TRUE(scene.end_frame(kInfinite).instances.empty());
    EXPECT_EQ(scene.counts().left_out, 1u);
    View invalid;
    invalid.forward.setConstant(std::numeric_limits<double>::quiet_NaN());
    EXPECT_TRUE(scene.begin_frame(invalid).empty());
    EXPECT_TRUE(scene.end_frame(1.0).instances.empty());
    scene.remove(group);
    scene.remove(group);
    EXPECT_EQ(scene.object_count(), 0u);
    EXPECT_TRUE(scene.begin_frame(View{}).empty());
}

TEST(Scene, RefusesModelsAndObjectsThatAreOutOfRangeWithTheirNumber) {
    Scene scene = Scene::create({}).value();
    const auto message = [](const auto& result) {
        return result.has_value() ? std::string() : result.error().message;
    };
    EXPECT_EQ(message(Scene::create({.fade_ratio = 2.5})), "fade_ratio must be 1 to 2, got 2.5");
    EXPECT_EQ(message(Scene::create({.far_distance = 0.0})), "far_distance must be above 0, got 0");
    ObjectModel model = tree_model();
    model.levels.clear();
    EXPECT_EQ(message(scene.add_model(model)), "a model must have at least one level, got 0");
    model = tree_model();
    model.levels[2].error_m = 0.06;
    EXPECT_EQ(message(scene.add_model(model)),
              "error_m must be above 0 and at least twice the one before, got 0.06 after 0.05 in "
              "level 2");
    model = tree_model();
    model.impostor.reset();
    EXPECT_EQ(message(scene.add_model(model)), "there is no impostor for it in level 3");
    model = tree_model();
    model.absence_error_m = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(message(scene.add_model(model)), "");
    EXPECT_EQ(message(add_instances(scene, ModelId{0}, {})), "there is no model 0 of 0");
    const ModelId trees = scene.add_model(tree_model()).value();
    std::vector<PlacedObject> objects(3);
    objects[1].scale = 0.0f;
    EXPECT_EQ(message(add_instances(scene, trees, objects)),
              "scale must be 1e-6 to 1e6, got 0 of object 1");
    objects[1].scale = 1.0f;
    objects[2].position.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message(add_instances(scene, trees, objects)),
              "coordinates must be within 2e9 m, got nan of object 2");
    objects[2].position.x() = 0.0;
    objects[0].rotation = {0.0f, 0.0f, 0.0f, 0.5f};
    EXPECT_EQ(message(add_instances(scene, trees, objects)),
              "the quaternion must have unit length, got 0.5 of object 0");
    EXPECT_EQ(scene.object_count(), 0u);
}

}  // namespace
}  // namespace terrane::test::scene
