// SPDX-License-Identifier: MIT
//
// What a collision step has proved counts for the next one only over the same chunks.
#include "collision/world/busy_world.h"
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

namespace terrane {
namespace changing_ground_test {

using test::make_test_ground;

constexpr double kStep = 1.0 / 60.0;

Ground make_waves(double height) {
    return make_test_ground(
        [height](double x, double y) {
            return height + 0.5 * std::sin(0.7 * x) + 0.4 * std::cos(0.9 * y);
        },
        1.0, 1);
}

World make_rolling_world(bool allow_sleep) {
    Result<World> world = World::create({.allow_sleep = allow_sleep});
    if (!world) std::abort();
    test::Random random(11);
    const std::vector<Shape> shapes = test::all_shapes(0.4);
    for (std::size_t i = 0; i < 40; ++i) {
        BodyState state;
        state.pose.translation = {random.between(20.0, 100.0), random.between(20.0, 100.0), 8.0};
        state.pose.rotation = random.rotation();
        state.velocity = 4.0 * random.direction();
        if (!world->add({.shape = shapes[i % shapes.size()]}, state)) std::abort();
    }
    return std::move(*world);
}

TEST(ChangingGround, WithTheSameHeightsInOtherChunksChangesNoBit) {
    // Each ground has chunks of its own, so that nothing that was proved counts in the second world.
    const Ground ground = make_waves(5.0);
    const std::vector<Ground> others{make_waves(5.0), make_waves(5.0)};
    World one = make_rolling_world(true), other = make_rolling_world(true);
    for (std::size_t i = 0; i < 300; ++i) {
        one.step(ground, kStep);
        other.step(others[i % 2], kStep);
        ASSERT_EQ(one.state_hash(), other.state_hash()) << i;
    }
}

/// A copy that has proved nothing.
World make_copy(const World& world) {
    Result<World> copy = World::load(world.save());
    if (!copy) std::abort();
    return std::move(*copy);
}

TEST(ChangingGround, ThatRisesUnderBodiesIsNoticedInTheNextStep) {
    const Ground low = make_waves(5.0), high = make_waves(6.5);
    World world = make_rolling_world(false);
    for (int i = 0; i < 600; ++i) world.step(low, kStep);
    EXPECT_EQ(world.step(low, kStep).too_deep, 0u);
    World copy = make_copy(world);
    const StepReport report = world.step(high, kStep);
    EXPECT_EQ(report.too_deep, report.awake);
    copy.step(high, kStep);
    EXPECT_EQ(world.state_hash(), copy.state_hash());
    for (int i = 0; i < 300; ++i) world.step(high, kStep);
    EXPECT_EQ(world.step(high, kStep).too_deep, 0u);
}

TEST(ChangingGround, ThatChangedWhileABodySleptIsNoticedWhenItWakes) {
    const Ground low = make_waves(5.0), high = make_waves(6.5);
    World world = make_rolling_world(true);
    StepReport report;
    for (int i = 0; i < 1200; ++i) report = world.step(low, kStep);
    ASSERT_GT(report.asleep, 10u);
    world.step(high, kStep);
    World copy = make_copy(world);
    for (World* const each : {&world, &copy}) {
        for (std::size_t i = 0; i < each->states().size(); ++i) {
            const WorldPos& place = each->states()[i].pose.translation;
            ASSERT_TRUE(each->apply_impulse(each->id(i), place, {0.0, 0.0, 1e-9}));
        }
        report = each->step(high, kStep);
        EXPECT_EQ(report.too_deep, report.awake);
    }
    EXPECT_EQ(world.state_hash(), copy.state_hash());
}

}  // namespace changing_ground_test
}  // namespace terrane
