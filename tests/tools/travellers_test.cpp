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
            vehicle.control(world, false);
            EXPECT_EQ(world.step(ground, 1.0 / 60.0).too_deep, 0u);
        }
        EXPECT_TRUE(vehicle.is_supported(world));
        EXPECT_LT(world.state(*body).velocity.norm(), 0.1);
        EXPECT_LT(
            (vehicle.pose(world).translation - WorldPos(0.0, 0.0, source->height(0.0, 0.0))).norm(),
            settings.centre_of_mass_height + 0.5);
        EXPECT_FALSE(vehicle.has_ended(world));
        std::vector<DrawnObject> objects;
        vehicle.draw(world, objects);
        EXPECT_GE(objects.size(), 1 + 2 * world.vehicle(*body)->wheels.size());
    }
}

TEST(VehicleTraveller, RefusesAStartInsideABodyOfTheScene) {
    const auto source = FractalHeights::create({.seed = 9}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-50.0, -50.0, 50.0, 50.0}, 0.0);
    pager.update({}, {}, 0.0);
    const Ground ground = pager.ground();
    World world = World::create({}).value();
    World scene = World::create({}).value();
    BodyState state;
    state.pose.translation = {0.0, 0.0, source->height(0.0, 0.0) + 1.0};
    ASSERT_TRUE(scene.add({.shape = Box{{1.0, 1.0, 1.0}}, .type = BodyType::static_body}, state));
    VehicleTraveller vehicle(make_truck(),
                             PathDriver::create({{0.0, 0.0}, {20.0, 0.0}}, {}).value(),
                             OnRoll::stop, *source, {0.0, 0.0}, {1.0, 0.0});
    const Result<BodyId> body = vehicle.enter(world, ground, scene);
    ASSERT_FALSE(body);
    EXPECT_NE(body.error().message.find("where the vehicle starts"), std::string::npos);
}

}  // namespace vehicle_traveller_test

namespace character_traveller_test {

constexpr double kStep = 1.0 / 60.0;

/// A character on gentle ground that walks 20 m east.
class CharacterWalk : public testing::Test {
protected:
    CharacterWalk()
        : source_(FractalHeights::create({.seed = 9, .amplitude = 20.0}).value()),
          pager_(Pager::create(source_, {.worker_count = 0}).value()),
          world_(World::create({}).value()),
          walk_({}, Polyline({{0.0, 0.0}, {20.0, 0.0}}), 2.0, *source_) {
        region_ = pager_.require({-50.0, -50.0, 50.0, 50.0}, 0.0);
        pager_.update({}, {}, 0.0);
    }

    Ground ground() const { return pager_.ground(); }

    /// Until it has ended; the seconds that takes, at most 60.
    double walk() {
        const Ground here = ground();
        double time = 0.0;
        for (; time < 60.0 && !walk_.has_ended(world_); time += kStep) {
            walk_.control(world_, true);
            EXPECT_EQ(world_.step(here, kStep).too_deep, 0u);
            walk_.react(world_, here, kStep);
        }
        return time;
    }

    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    RequiredRegion region_;
    World world_;
    CharacterTraveller walk_;
};

TEST_F(CharacterWalk, ReachesTheEndAtItsSpeed) {
    const World nothing = World::create({}).value();
    const Result<BodyId> body = walk_.enter(world_, ground(), nothing);
    ASSERT_TRUE(body) << body.error().message;
    EXPECT_FALSE(walk_.has_arrived());
    const double time = walk();
    EXPECT_TRUE(walk_.has_arrived());
    EXPECT_GT(time, 8.5);
    EXPECT_LT(time, 13.0);
    EXPECT_TRUE(walk_.is_supported(world_));
    EXPECT_NEAR(walk_.pose(world_).translation.x(), 19.5, 1.0);
}

TEST_F(CharacterWalk, GoesAroundAWall) {
    BodyState wall;
    wall.pose.translation = {10.0, 0.0, source_->height(10.0, 0.0)};
    ASSERT_TRUE(world_.add({.shape = Box{{0.3, 3.0, 3.0}}, .type = BodyType::static_body}, wall));
    const World nothing = World::create({}).value();
    ASSERT_TRUE(walk_.enter(world_, ground(), nothing));
    EXPECT_LT(walk(), 60.0);
    EXPECT_TRUE(walk_.has_arrived());
}

TEST_F(CharacterWalk, DoesNotStartInABodyOfTheScene) {
    World scene = World::create({}).value();
    BodyState block;
    block.pose.translation = {0.0, 0.5, source_->height(0.0, 0.0)};
    ASSERT_TRUE(scene.add({.shape = Box{{1.0, 1.0, 1.0}}, .type = BodyType::static_body}, block));
    const Result<BodyId> body = walk_.enter(world_, ground(), scene);
    ASSERT_FALSE(body);
    EXPECT_NE(body.error().message.find("where the character starts"), std::string::npos);
}

}  // namespace character_traveller_test
}  // namespace terrane::tools
