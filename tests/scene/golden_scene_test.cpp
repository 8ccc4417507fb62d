// SPDX-License-Identifier: MIT
//
// Bits of frames of a Scene. They may change only with an entry in CHANGELOG.md; a failure prints the new hash. Built
// with both compilers at several optimisation levels, which must agree.
#include "scene/random_scene.h"
#include "scene/scene_cases.h"
#include "support/random.h"

#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <vector>

namespace terrane {
namespace golden_scene_test {

// Structured bindings do not compile once a field is added that is not hashed.
void add_draws(test::Hash& hash, const SceneDraws& draws) {
    for (const auto& [offset_eye, scale, rotation, coverage, tint] : draws.instances) {
        hash.add(offset_eye);
        hash.add(scale);
        hash.add(rotation);
        hash.add(coverage);
        hash.add(tint);
    }
    for (const auto& [mesh, level, first_instance, instance_count] : draws.meshes) {
        hash.add(mesh);
        hash.add(level);
        hash.add(first_instance);
        hash.add(instance_count);
    }
    for (const auto& [impostor, first_instance, instance_count] : draws.impostors) {
        hash.add(impostor);
        hash.add(first_instance);
        hash.add(instance_count);
    }
}

std::vector<PlacedObject> scattered(std::size_t count, std::uint64_t seed, double half_side,
                                    double half_height) {
    test::Random random(seed);
    std::vector<PlacedObject> objects(count);
    for (PlacedObject& object : objects) {
        const double x = random.between(-half_side, half_side);
        const double y = random.between(-half_side, half_side);
        object.position = {x, y, random.between(-half_height, half_height)};
        object.scale = static_cast<float>(random.between(0.7, 1.4));
    }
    return objects;
}

// Of the demands and draws of a frame.
void add_frame(test::Hash& hash, Scene& scene, const WorldPos& eye, int frame, double threshold) {
    const View view = look_at(eye, eye + WorldPos(10.0 - frame, 7.0, -1.0), 1.0, 1280, 720).value();
    for (const TriangleDemand& demand : scene.begin_frame(view)) {
        hash.add(demand.threshold_px);
        hash.add(demand.triangles);
    }
    const SceneDraws draws = scene.end_frame(threshold);
    add_draws(hash, draws);
    for (const StreamedDraw& draw : draws.streamed) {
        hash.add(draw.instance);
        hash.add_all(draw.triangles);
    }
}

TEST(GoldenScene, IsTheSameWithEveryCompilerAtEveryLevel) {
    ObjectModel tree = test::tree_model();
    tree.mesh = MeshId{3};
    tree.impostor = ImpostorId{4};
    Scene scene = Scene::create({}).value();
    const ModelId model = scene.add_model(tree).value();
    ASSERT_TRUE(test::add_instances(scene, model, scattered(4000, 8, 2000.0, 20.0)));
    test::Hash hash;
    std::size_t drawn = 0;
    for (int frame = 0; frame < 12; ++frame) {
        add_frame(hash, scene, {30.0 * frame, -20.0 * frame, 10.0}, frame, 0.5 + frame);
        drawn += scene.counts().drawn;
    }
    EXPECT_GT(drawn, 1000u);
    EXPECT_EQ(hash.value(), 0xe4f5023c0a70c1d7u) << std::hex << hash.value();
}

TEST(GoldenScene, OfContinuousLevelsIsTheSameWithEveryCompilerAtEveryLevel) {
    Scene scene = Scene::create({.most_continuous = 6}).value();
    const ModelId rock = scene.add_model(test::make_rock_levels(3, 4).model).value();
    ASSERT_TRUE(test::add_instances(scene, rock, scattered(60, 9, 30.0, 5.0)));
    test::Hash hash;
    std::size_t drawn = 0;
    for (int frame = 0; frame < 20; ++frame) {
        add_frame(hash, scene, {-25.0 + 2.0 * frame, -1.5 * frame, 2.0}, frame, 0.5 + 0.1 * frame);
        drawn += scene.counts().continuous;
    }
    EXPECT_GT(drawn, 60u);
    EXPECT_EQ(hash.value(), 0xa366aa45332fb4f0u) << std::hex << hash.value();
}

}  // namespace golden_scene_test
}  // namespace terrane
