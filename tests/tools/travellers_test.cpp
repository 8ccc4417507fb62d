// SPDX-License-Identifier: MIT
#include "commands/travellers.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

namespace terrane::tools {
namespace vehicle_traveller_test {

TEST(VehicleTraveller, EveryVehicleIsPutOnTheGroundAndComesToRest) {
    const auto source = FractalHeights::create({.seed = 9, .amplitude = 20.0}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-50.0, -50.0, 50.0, 50.0}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    for (std::size_t i = 0; i < vehicle_names().size(); ++i) {
        SCOPED_TRACE(vehicle_names()[i]);
        World world = World::create({}).value();
        const World nothing = World::create({}).value();
        const VehicleSettings settings = make_vehicle(static_cast<VehicleKind>(i));
        PathDriver driver = PathDriver::create({{0.0, 0.0}, {20.0, 10.0}}, {}).value();
        VehicleTraveller vehicle(settings, std::move(driver), OnRoll::stop, *source, {0.0, 0.0},
                                 {20.0, 10.0});
        const Result<BodyId> body = vehicle.enter(world, ground, nothing);
        ASSERT_TRUE(body) << body.error().message;
        EXPECT_LT(compute_lift(world.settings(*body).shape, vehicle.pose(world), ground).lift,
                  -0.04);
        for (int step = 0; step < 120; ++step) {
            vehicle.control(world, false, 1.0 / 60.0);
            EXPECT_EQ(world.step(ground, 1.0 / 60.0).too_deep, 0u);
        }
        EXPECT_TRUE(vehicle.is_supported(world));
        EXPECT_LT(world.state(*body).velocity.norm(), 0.1);
        EXPECT_LT(
            (vehicle.pose(world).translation - WorldPos(0.0, 0.0, source->height(0.0, 0.0))).norm(),
            settings.centre_of_mass_height + 0.5);
        EXPECT_FALSE(vehicle.has_ended(world));
    }
}

}  // namespace vehicle_traveller_test

namespace character_traveller_test {

constexpr double kStep = 1.0 / 60.0;

TEST(CharacterTraveller, ReachesTheEndAtItsSpeed) {
    const auto source = FractalHeights::create({.seed = 9, .amplitude = 20.0}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-50.0, -50.0, 50.0, 50.0}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    World world = World::create({}).value();
    const World nothing = World::create({}).value();
    CharacterTraveller walk({}, Polyline({{0.0, 0.0}, {20.0, 0.0}}), 2.0, *source);
    const Result<BodyId> body = walk.enter(world, ground, nothing);
    ASSERT_TRUE(body) << body.error().message;
    EXPECT_FALSE(walk.progress().has_arrived);
    double time = 0.0;
    for (; time < 60.0 && !walk.has_ended(world); time += kStep) {
        walk.control(world, true, kStep);
        EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
        walk.react(world, ground, kStep);
    }
    EXPECT_TRUE(walk.progress().has_arrived);
    EXPECT_EQ(walk.progress().share, 1.0);
    EXPECT_EQ(walk.progress().stuck_s, 0.0);
    EXPECT_GT(time, 8.5);
    EXPECT_LT(time, 13.0);
    EXPECT_TRUE(walk.is_supported(world));
    EXPECT_NEAR(walk.pose(world).translation.x(), 19.5, 1.0);
}

TEST(CharacterTraveller, SaysHowLongAndWhereAWallHoldsIt) {
    const auto source = FractalHeights::create({.seed = 9, .amplitude = 1.0}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-60.0, -60.0, 60.0, 60.0}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    World world = World::create({}).value();
    const BodySettings wall{.shape = Box{{0.5, 50.0, 20.0}}, .type = BodyType::static_body};
    ASSERT_TRUE(world.add(wall, {.pose = {.translation = {8.5, 0.0, source->height(8.5, 0.0)}}}));
    CharacterTraveller walk({}, Polyline({{0.0, 0.0}, {20.0, 0.0}}), 2.0, *source);
    ASSERT_TRUE(walk.enter(world, ground, World::create({}).value()));
    constexpr double kSeconds = 15.0;
    for (double time = 0.0; time < kSeconds; time += kStep) {
        walk.control(world, true, kStep);
        world.step(ground, kStep);
        walk.react(world, ground, kStep);
    }
    const PathProgress progress = walk.progress();
    EXPECT_FALSE(progress.has_arrived);
    EXPECT_NEAR(progress.share, 8.0 / 20.0, 0.05);
    EXPECT_NEAR(progress.stuck_s, kSeconds - 8.0 / 2.0, 1.5);
    ASSERT_TRUE(progress.stuck_world);
    EXPECT_NEAR(progress.stuck_world->x(), 7.6, 0.5);
}

}  // namespace character_traveller_test
}  // namespace terrane::tools
