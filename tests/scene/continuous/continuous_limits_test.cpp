// SPDX-License-Identifier: MIT
#include "scene/continuous/rock_levels.h"
#include "scene/culling/random_views.h"
#include "scene/objects/random_scene.h"

#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace terrane::test::continuous_limits {
namespace {

const ObjectModel& rock() {
    static const ObjectModel model = make_rock_levels(3, 1).model;
    return model;
}

// Bits of a frame's draws.
std::vector<std::byte> bits_of(const SceneDraws& draws) {
    std::vector<std::byte> bits;
    const auto add = [&](const auto& values) {
        const auto bytes = std::as_bytes(values);
        bits.insert(bits.end(), bytes.begin(), bytes.end());
    };
    add(draws.instances);
    add(draws.meshes);
    add(draws.impostors);
    for (const StreamedDraw& draw : draws.streamed) {
        add(draw.triangles);
        add(std::span(&draw.instance, 1));
    }
    return bits;
}

Scene make_scene(std::size_t most, const ObjectModel& model, std::uint64_t seed, int count) {
    Scene scene = Scene::create({.most_continuous = most}).value();
    const ModelId id = scene.add_model(model).value();
    Random random(seed);
    std::vector<PlacedObject> objects;
    for (int i = 0; i < count; ++i) objects.push_back(random_object(random, 20.0));
    EXPECT_TRUE(scene.add_group(id, objects));
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
    ASSERT_TRUE(scene.add_group(id, {&placed, 1}));
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
        const GroupId extra = scene.add_group(ModelId{0}, passing).value();
        scene.begin_frame(view);
        if (frame % 3 == 0) scene.end_frame(0.5);
        scene.remove_group(extra);
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
