// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"
#include "scene/scene_cases.h"

#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace terrane::test::scene_casters {
namespace {

SunShadows random_shadows(Random& random) {
    return {.sun_direction = random.direction(), .distance = std::exp2(random.between(3.0, 12.0))};
}

// An instance by its bits, without coverage; the scales of the objects below are all different.
using Which = std::array<float, 8>;
Which which(const ObjectInstance& instance) {
    const auto& [x, y, z] = instance.offset_eye;
    const auto& [i, j, k, w] = instance.rotation;
    return {x, y, z, instance.scale, i, j, k, w};
}

template <class Draw>
std::size_t count(std::span<const Draw> list) {
    std::size_t instances = 0;
    for (const Draw& draw : list) instances += draw.instance_count;
    return instances;
}

// A model that is drawn at any distance.
ObjectModel lasting_model() {
    ObjectModel model = tree_model();
    model.absence_error_m = std::numeric_limits<double>::infinity();
    return model;
}

TEST(SceneCasters, EveryObjectWhoseShadowCanFallIntoTheViewIsDrawnOrACaster) {
    int needed = 0;
    std::size_t out_of_view = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene scene = Scene::create({.fade_ratio = random.between(1.0, 2.0)}).value();
        const ObjectModel model = lasting_model();
        const ModelId id = scene.add_model(model).value();
        std::vector<PlacedObject> objects;
        for (int group = 0; group < 3; ++group) {
            std::vector<PlacedObject> of_group;
            for (int i = 0; i < 500; ++i) of_group.push_back(random_object(random, 600.0));
            ASSERT_TRUE(add_instances(scene, id, of_group));
            objects.insert(objects.end(), of_group.begin(), of_group.end());
        }
        for (int frame = 0; frame < 20; ++frame) {
            const View view = random_view(random, WorldPos::Zero());
            const SunShadows shadows = random_shadows(random);
            scene.begin_frame(view, 0.0, shadows);
            const SceneDraws draws = scene.end_frame(std::exp2(random.between(-4.0, 8.0)));
            std::set<float> given_scales;
            for (const ObjectInstance& instance : draws.instances)
                given_scales.insert(instance.scale);
            const std::size_t casters = count(draws.caster_meshes) + count(draws.caster_impostors);
            ASSERT_EQ(draws.instances.size(),
                      count(draws.meshes) + count(draws.impostors) + casters);
            out_of_view += casters;
            for (const PlacedObject& object : objects) {
                const Eigen::Vector3d size = model.bounds.high - model.bounds.low;
                bool is_needed = false;
                for (int k = 0; k < 20 && !is_needed; ++k) {
                    const Eigen::Vector3d share(random.between(0.0, 1.0), random.between(0.0, 1.0),
                                                random.between(0.0, 1.0));
                    const WorldPos p =
                        object.position +
                        rotation_of(object) * (static_cast<double>(object.scale) *
                                               (model.bounds.low + size.cwiseProduct(share)));
                    const double length = random.below(4) == 0 ? 0.0 : random.between(0.0, 1500.0);
                    is_needed =
                        is_shown(view, p - length * shadows.sun_direction, shadows.distance);
                }
                if (!is_needed) continue;
                ++needed;
                ASSERT_TRUE(given_scales.contains(object.scale)) << "frame " << frame;
            }
        }
    }
    EXPECT_GT(needed, 10'000);
    EXPECT_GT(out_of_view, 10'000u);
}

TEST(SceneCasters, ShadowsChangeNothingOfWhatIsDrawnAndNoCount) {
    int compared = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene with = Scene::create({.cull_test = CullTest::exact}).value();
        Scene without = Scene::create({.cull_test = CullTest::exact}).value();
        for (std::uint32_t i = 0; i < 3; ++i) {
            const ObjectModel model = random_model(random, i);
            std::vector<PlacedObject> objects;
            for (int k = 0; k < 400; ++k) objects.push_back(random_object(random, 400.0));
            for (Scene* scene : {&with, &without})
                ASSERT_TRUE(add_instances(*scene, scene->add_model(model).value(), objects));
        }
        for (int frame = 0; frame < 20; ++frame) {
            const View view = random_view(random, WorldPos::Zero());
            const double least = random.below(2) == 0 ? 0.0 : random.between(0.0, 4.0);
            const std::span<const TriangleDemand> demands =
                with.begin_frame(view, least, random_shadows(random));
            ASSERT_TRUE(are_equal(demands, without.begin_frame(view, least)));
            const double threshold = std::exp2(random.between(-4.0, 8.0));
            SceneDraws seen = with.end_frame(threshold);
            const SceneDraws expected = without.end_frame(threshold);
            EXPECT_TRUE(expected.caster_meshes.empty());
            EXPECT_TRUE(expected.caster_impostors.empty());
            EXPECT_EQ(without.counts().casters, 0u);
            ASSERT_EQ(with.counts().in_view, without.counts().in_view);
            ASSERT_EQ(with.counts().drawn, without.counts().drawn);
            ASSERT_EQ(with.counts().left_out, without.counts().left_out);
            ASSERT_EQ(with.counts().triangles, without.counts().triangles);
            ASSERT_GE(seen.instances.size(), expected.instances.size());
            seen.instances = seen.instances.first(expected.instances.size());
            ASSERT_EQ(bits_of(seen), bits_of(expected));
            compared += expected.instances.empty() ? 0 : 1;
        }
    }
    EXPECT_GT(compared, 100) << "of 400 frames";
}

TEST(SceneCasters, ACasterHasTheLevelsThatAViewOfItHas) {
    int casters = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene scene = Scene::create({}).value();
        const ModelId id = scene.add_model(tree_model()).value();
        ASSERT_TRUE(add_instances(scene, id, spread_objects(random, 2000, 500.0)));
        View view = random_view(random, WorldPos::Zero());
        view.vertical_fov = 0.7;
        const SunShadows shadows{.sun_direction = {0.8, 0.1, 0.6}, .distance = 500.0};
        const double threshold = random.between(0.5, 4.0);
        using Levels = std::set<std::tuple<bool, std::uint32_t, float>>;
        std::map<Which, Levels> of_caster, of_drawn;
        const auto add = [](const SceneDraws& draws, const auto& list, bool is_impostor,
                            const auto& level_of, std::map<Which, Levels>& out) {
            for (const auto& draw : list) {
                for (std::uint32_t i = 0; i < draw.instance_count; ++i) {
                    const ObjectInstance& instance = draws.instances[draw.first_instance + i];
                    out[which(instance)].insert({is_impostor, level_of(draw), instance.coverage});
                }
            }
        };
        const auto mesh_level = [](const MeshDraw& draw) { return draw.level; };
        const auto no_level = [](const ImpostorDraw&) { return 0u; };
        scene.begin_frame(view, 0.0, shadows);
        SceneDraws draws = scene.end_frame(threshold);
        add(draws, draws.caster_meshes, false, mesh_level, of_caster);
        add(draws, draws.caster_impostors, true, no_level, of_caster);
        ASSERT_EQ(of_caster.size(), scene.counts().casters);
        // all that is around, in views of the same focal length
        const Eigen::Matrix3d axes =
            (Eigen::Matrix3d() << view.right(), view.forward, view.up).finished();
        for (const double sign : {1.0, -1.0}) {
            for (int axis = 0; axis < 3; ++axis) {
                View turned = view;
                turned.forward = sign * axes.col(axis);
                turned.up = axes.col((axis + 1) % 3);
                // wide, at the same number of pixels per radian
                turned.vertical_fov = 2.0 * std::atan(1.05);
                turned.height_px = 1000;
                turned.width_px = 1000;
                const double ratio = turned.pixels_per_radian() / view.pixels_per_radian();
                scene.begin_frame(turned);
                draws = scene.end_frame(threshold * ratio);
                add(draws, draws.meshes, false, mesh_level, of_drawn);
                add(draws, draws.impostors, true, no_level, of_drawn);
            }
        }
        for (const auto& [caster, levels] : of_caster) {
            ++casters;
            ASSERT_TRUE(of_drawn.contains(caster));
            const Levels& expected = of_drawn[caster];
            // coverages differ by the rounding of the thresholds
            const auto close = [](const auto& a, const auto& b) {
                return std::get<0>(a) == std::get<0>(b) && std::get<1>(a) == std::get<1>(b) &&
                       std::abs(std::get<2>(a) - std::get<2>(b)) < 1e-3f;
            };
            for (const auto& level : levels) {
                ASSERT_TRUE(std::any_of(expected.begin(), expected.end(),
                                        [&](const auto& other) { return close(level, other); }));
            }
        }
    }
    EXPECT_GT(casters, 500);
}

TEST(SceneCasters, AreNoneBeyondTheFarDistanceAndNoneForShadowsOutOfRange) {
    Scene scene = Scene::create({.far_distance = 100.0}).value();
    const ModelId id = scene.add_model(lasting_model()).value();
    const auto add = [&](const WorldPos& at) {
        const PlacedObject object{.position = at};
        ASSERT_TRUE(add_instances(scene, id, {&object, 1}));
    };
    // north; the sun is in the west
    View view;
    add({-200.0, 50.0, 100.0});
    add({-400.0, 150.0, 100.0});
    const auto casters = [&](const SunShadows& shadows) {
        scene.begin_frame(view, 0.0, shadows);
        scene.end_frame(1.0);
        EXPECT_EQ(scene.counts().in_view, 0u);
        return scene.counts().casters;
    };
    EXPECT_EQ(casters({.sun_direction = {-2.0, 0.0, 1.0}, .distance = 1000.0}), 1u);
    EXPECT_EQ(casters({.sun_direction = {2.0, 0.0, 1.0}, .distance = 1000.0}), 0u);
    EXPECT_EQ(casters({.sun_direction = {-2.0, 0.0, 1.0}, .distance = 0.0}), 0u);
    EXPECT_EQ(casters({.sun_direction = Eigen::Vector3d::Zero(), .distance = 1000.0}), 0u);
    scene.begin_frame(view, 0.0, SunShadows{.sun_direction = {-2.0, 0.0, 1.0}, .distance = 1e3});
    EXPECT_TRUE(scene.end_frame(std::numeric_limits<double>::infinity()).instances.empty());
}

TEST(SceneCasters, AreGoneWithTheirGroup) {
    Scene scene = Scene::create({}).value();
    const ModelId id = scene.add_model(lasting_model()).value();
    const PlacedObject object{.position = {-200.0, 50.0, 100.0}};
    const NodeId group = add_instances(scene, id, {&object, 1}).value();
    const SunShadows shadows{.sun_direction = {-2.0, 0.0, 1.0}, .distance = 1000.0};
    scene.begin_frame(View{}, 0.0, shadows);
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 1u);
    scene.begin_frame(View{}, 0.0, shadows);
    scene.remove(group);
    EXPECT_TRUE(scene.end_frame(1.0).instances.empty());
    scene.begin_frame(View{}, 0.0, shadows);
    EXPECT_TRUE(scene.end_frame(1.0).instances.empty());
}

}  // namespace
}  // namespace terrane::test::scene_casters
