// SPDX-License-Identifier: MIT
#include "scene/wheel_ruts.h"

#include "scene/ground_editor.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace terrane::tools {
namespace wheel_ruts_test {

constexpr double kStep = 1.0 / 60.0;
constexpr double kMiddle = 0.9;  // y of the left wheels, metres
constexpr WorldRect kAround{-40.0, -40.0, 60.0, 40.0};

TEST(WheelRuts, AreWhereTheWheelsRolledAndAreDug15CmDeep) {
    FractalSettings gentle{.seed = 9, .amplitude = 4.0};
    gentle.finest_spacing_log2 = -2;
    Terrain terrain;
    terrain.source = FractalHeights::create(gentle).value();
    terrain.name = "seed 9";
    const std::shared_ptr<const HeightSource> undisturbed = terrain.source;
    const auto ruts = WheelRuts::create(terrain, 0).value();
    ASSERT_NE(terrain.source, undisturbed);
    Pager pager = Pager::create(terrain.source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require(kAround, 0.0);
    pager.update({}, {}, 0.0);

    World world = World::create({}).value();
    const VehicleSettings settings = make_truck();
    Pose pose;
    pose.translation = {0.0, 0.0, undisturbed->height(0.0, 0.0) + 1.5};
    const BodyId truck = world.add_vehicle(settings, pose).value();
    // Asleep where a wheel passes over the ground beside it.
    const double beside = undisturbed->height(8.0, 1.42);
    BodyState state;
    state.pose.translation = {8.0, 1.42, beside + 0.1};
    const BodyId stone = world.add({.shape = Sphere{0.1}}, state).value();
    std::vector<WorldPos> rolled;
    bool was_asleep = false, was_woken = false;
    for (int i = 0; i < 360; ++i) {
        const Aabb changed = ruts->update(pager);
        const bool has_changed = (changed.low.array() <= changed.high.array()).all();
        world.wake(changed);
        pager.update({}, {}, i * kStep);
        const Ground ground = pager.ground();
        const VehicleControls controls =
            i < 90 ? VehicleControls{.brake = 1.0} : VehicleControls{.throttle = 0.6};
        ASSERT_TRUE(world.set_controls(truck, controls));
        const bool sleeps = world.state(stone).condition == BodyCondition::asleep;
        was_asleep |= sleeps;
        was_woken |= was_asleep && has_changed && !sleeps;
        EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
        const VehicleState& vehicle = *world.vehicle(truck);
        if (i >= 120 && vehicle.wheels[0].in_contact)
            rolled.push_back(vehicle.wheels[0].point_world);
        ruts->roll(vehicle, settings.wheel_radius, ground);
    }
    EXPECT_TRUE(was_woken);
    ASSERT_GT(ruts->digs(), 10u);
    ASSERT_GT((rolled.back() - rolled.front()).norm(), 10.0);
    const Ground ground = pager.ground();
    std::size_t deep = 0, sunk = 0;
    for (const WorldPos& p : rolled) {
        // The tyre touches the groove beside its lowest line.
        const double before = undisturbed->height(p.x(), kMiddle);
        const HeightAnswer now = ground.height(p.x(), kMiddle);
        ASSERT_EQ(now.status, QueryStatus::ok);
        EXPECT_GT(now.height, before - 0.2);
        deep += now.height < before - 0.1 ? 1u : 0u;
        sunk += p.z() < undisturbed->height(p.x(), p.y()) - 0.04 ? 1u : 0u;
        EXPECT_NEAR(ground.height(p.x(), 0.0).height, undisturbed->height(p.x(), 0.0), 0.03);
    }
    EXPECT_GT(sunk, rolled.size() * 8 / 10);
    EXPECT_GT(deep, rolled.size() * 8 / 10);
}

TEST(GroundEditor, DigsFillsAndUndoesInTheBoxesThatItTells) {
    FractalSettings gentle{.seed = 9, .amplitude = 4.0};
    gentle.finest_spacing_log2 = -1;
    Terrain terrain;
    terrain.source = FractalHeights::create(gentle).value();
    terrain.name = "seed 9";
    const std::shared_ptr<const HeightSource> undisturbed = terrain.source;
    const auto editor = GroundEditor::create(terrain, 0).value();
    EXPECT_EQ(editor->least_radius(), 1.0);
    EXPECT_FALSE(editor->undo());
    Pager pager = Pager::create(terrain.source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require(kAround, 0.0);
    double time = 0.0;
    const auto height_after = [&](bool changes) {
        const Aabb box = editor->update(pager);
        const WorldPos middle(3.0, 4.0, undisturbed->height(3.0, 4.0));
        const bool has_middle =
            (box.low.array() <= middle.array()).all() && (box.high.array() >= middle.array()).all();
        EXPECT_EQ(has_middle, changes);
        pager.update({}, {}, time += kStep);
        return pager.ground().height(3.0, 4.0).height;
    };
    const double before = height_after(false);
    const WorldPos at(3.0, 4.0, before);
    ASSERT_TRUE(editor->add({.from_world = at, .to_world = at, .radius = 2.0}));
    EXPECT_NEAR(height_after(true), before - 2.0, 0.3);
    EXPECT_NEAR(height_after(false), before - 2.0, 0.3);
    ASSERT_TRUE(editor->add({.fills = true, .from_world = at, .to_world = at, .radius = 3.0}));
    EXPECT_NEAR(height_after(true), before + 3.0, 0.3);
    ASSERT_TRUE(editor->undo());
    EXPECT_NEAR(height_after(true), before - 2.0, 0.3);
    ASSERT_TRUE(editor->undo());
    EXPECT_EQ(height_after(true), before);
    const WorldPos along(5.0, 0.0, 0.0);
    const GroundEdit tube{.from_world = at - along, .to_world = at + along, .radius = 1.5};
    ASSERT_TRUE(editor->add(tube));
    EXPECT_NEAR(height_after(true), before - 1.5, 0.3);
    EXPECT_FALSE(editor->add({.from_world = at, .to_world = at, .radius = std::nan("")}));

    const double after = pager.ground().height(3.0, 4.0).height;
    const GroundEdit ball{.from_world = at, .to_world = at, .radius = 3.0};
    for (const std::vector<GroundEdit>& edits :
         {std::vector{tube, ball}, std::vector{ball}, std::vector{tube}}) {
        ASSERT_TRUE(editor->set_edits(edits));
        height_after(true);
        EXPECT_TRUE(std::ranges::equal(editor->edits_in_force(), edits));
    }
    EXPECT_EQ(pager.ground().height(3.0, 4.0).height, after);
    ASSERT_TRUE(editor->set_edits(std::vector{tube}));
    height_after(false);
    ASSERT_TRUE(editor->set_edits({}));
    EXPECT_TRUE(editor->finish(pager));
    EXPECT_TRUE(editor->edits_in_force().empty());
    EXPECT_EQ(height_after(false), before);
}

}  // namespace wheel_ruts_test
}  // namespace terrane::tools
