// SPDX-License-Identifier: MIT
// Objects of a scene that the ground hides.
#include "scene/horizon/hill_world.h"
#include "scene/objects/random_scene.h"

#include <terrane/scene/horizon_map.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <vector>

namespace terrane::test::occlusion {
namespace {

using Offset = std::array<float, 3>;

class ForestOnHills : public testing::Test {
protected:
    ForestOnHills() {
        const ModelId model = scene.add_model(tree_model()).value();
        Random random(6);
        trees = spread_objects(random, 3000, 1000.0);
        for (PlacedObject& tree : trees) {
            WorldPos& p = tree.position_world;
            p.z() = source->height(p.x(), p.y());
        }
        EXPECT_TRUE(scene.add_group(model, trees).has_value());
    }

    View low_view(double turn) const {
        const WorldPos eye(20.0, -30.0, source->height(20.0, -30.0) + 4.0);
        return view_along(eye, {std::cos(turn), std::sin(turn)}, -0.05, 0.0);
    }

    // Offsets of the objects that are drawn.
    std::set<Offset> drawn(const View& view, const HorizonMap* horizon) {
        scene.begin_frame(view, 1.0, {}, horizon);
        std::set<Offset> offsets;
        for (const ObjectInstance& instance : scene.end_frame(1.0).instances)
            offsets.insert(instance.offset_eye);
        return offsets;
    }

    std::shared_ptr<const HeightSource> source = FractalHeights::create({.seed = 4,
                                                                         .octave_count = 8,
                                                                         .amplitude = 150.0,
                                                                         .wavelength_log2 = 10,
                                                                         .finest_spacing_log2 = 2,
                                                                         .root_size_log2 = 10})
                                                     .value();
    std::shared_ptr<const ResidentSet> resident = resident_chunks(*source, 1);
    Scene scene = Scene::create({}).value();
    std::vector<PlacedObject> trees;
};

TEST_F(ForestOnHills, ObjectsThatAreLeftOutHaveNoPointInSight) {
    const Ground ground(resident, 1);
    HorizonMap horizon;
    std::size_t occluded = 0, in_view = 0;
    for (int i = 0; i < 12; ++i) {
        const View view = low_view(0.5 * i);
        horizon.build(resident, view, {.refinable_px = 1.0});
        const std::set<Offset> all = drawn(view, nullptr);
        EXPECT_EQ(scene.counts().occluded, 0u);
        const SceneCounts without = scene.counts();
        const std::set<Offset> in_sight = drawn(view, &horizon);
        const SceneCounts& counts = scene.counts();
        EXPECT_GE(counts.in_view + counts.occluded, without.in_view);
        EXPECT_LE(counts.in_view, without.in_view);
        occluded += without.drawn - counts.drawn;
        in_view += without.drawn;
        for (const Offset& offset : in_sight) ASSERT_TRUE(all.contains(offset)) << "it moved";
        for (const Offset& offset : all) {
            if (in_sight.contains(offset)) continue;
            const WorldPos foot =
                view.eye_world + Eigen::Vector3f(offset[0], offset[1], offset[2]).cast<double>();
            // the top of the smallest tree, up to the tallest one's
            for (const double height : {0.5, 3.0, 5.6}) {
                const WorldPos p = foot + Eigen::Vector3d(0.0, 0.0, height);
                const RayAnswer answer = ground.ray(view.eye_world, p);
                ASSERT_EQ(answer.status, GroundStatus::ok)
                    << height << " m of a tree in view " << i;
            }
        }
    }
    EXPECT_GT(occluded, in_view / 4);
}

TEST_F(ForestOnHills, AMapOfAnotherViewHidesNothing) {
    HorizonMap horizon;
    horizon.build(resident, low_view(0.5), {.refinable_px = 1.0});
    const View view = low_view(0.6);
    EXPECT_EQ(drawn(view, &horizon), drawn(view, nullptr));
    EXPECT_EQ(scene.counts().occluded, 0u);
    horizon.clear();
    EXPECT_EQ(drawn(low_view(0.5), &horizon), drawn(low_view(0.5), nullptr));
}

TEST_F(ForestOnHills, NothingIsHiddenWhileShadowsAreDrawn) {
    const View view = low_view(0.5);
    HorizonMap horizon;
    horizon.build(resident, view, {.refinable_px = 1.0});
    EXPECT_LT(drawn(view, &horizon).size(), drawn(view, nullptr).size());
    const SunShadows shadows{.sun_direction = {1.0, 0.0, 0.5}, .distance = 500.0};
    scene.begin_frame(view, 1.0, shadows, nullptr);
    const std::size_t all = scene.counts().in_view;
    scene.begin_frame(view, 1.0, shadows, &horizon);
    EXPECT_EQ(scene.counts().in_view, all);
    EXPECT_EQ(scene.counts().occluded, 0u);
}

TEST_F(ForestOnHills, AFrameDependsOnItsMapAlone) {
    HorizonMap fresh, used;
    used.build(resident, low_view(2.0), {.refinable_px = 30.0});
    for (HorizonMap* horizon : {&fresh, &used})
        horizon->build(resident, low_view(0.5), {.refinable_px = 1.0});
    const std::set<Offset> first = drawn(low_view(0.5), &fresh);
    EXPECT_GT(scene.counts().occluded, 0u);
    drawn(low_view(3.0), nullptr);
    EXPECT_EQ(drawn(low_view(0.5), &used), first);
}

}  // namespace
}  // namespace terrane::test::occlusion
