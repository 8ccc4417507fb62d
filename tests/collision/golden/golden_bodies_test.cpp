// SPDX-License-Identifier: MIT
// Bits of body states after a second of falling, bouncing and sliding. They may change only with an entry in
// CHANGELOG.md; a failure prints the new hash. Built with both compilers at several optimisation levels, which must
// agree.
#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane {
namespace golden_bodies_test {

TEST(GoldenBodies, AreTheSameWithEveryCompilerAtEveryLevel) {
    const auto source = FractalHeights::create({.seed = 12, .root_size_log2 = 12}).value();
    Pager pager = Pager::create(source, {.worker_count = 0, .horizon = 0.1}).value();
    World world = World::create({}).value();
    const std::array<Shape, 3> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 2.0, 0.5}}};
    for (int i = 0; i < 18; ++i) {
        BodyState state;
        const double x = 11.0 * i - 90.0, y = 7.0 * (i % 5);
        state.pose.translation = {x, y, source->height(x, y) + 4.0 + 0.5 * i};
        state.velocity = {3.0 * (i % 4), -2.0, -20.0 * (i % 6)};
        state.angular_velocity = {0.5 * i, 1.0, -2.0};
        ASSERT_TRUE(
            world.add({.shape = shapes[static_cast<std::size_t>(i) % 3]}, state).has_value());
    }
    for (int step = 0; step < 60; ++step) {
        pager.update({}, world.needs(), step / 60.0);
        world.step(Ground(pager.resident(), pager.contact_level()), 1.0 / 60.0);
    }
    EXPECT_EQ(world.state_hash(), 0x653de30922f4de9bu) << std::hex << world.state_hash();
}

// A heap of all shapes, on several threads.
TEST(GoldenBodies, OfAHeapAreTheSameWithEveryCompilerAtEveryLevel) {
    const auto source = FractalHeights::create({.seed = 12, .root_size_log2 = 12}).value();
    Pager pager = Pager::create(source, {.worker_count = 0, .horizon = 0.1}).value();
    World world = World::create({.worker_count = 3}).value();
    const ConvexHull wedge =
        ConvexHull::create(
            std::vector<Eigen::Vector3d>{{0, 0, 0}, {1.1, 0, 0}, {0, 0.9, 0}, {0.2, 0.1, 0.8}})
            .value();
    CompoundPart knob{Sphere{0.4}, {}};
    knob.body_from_part.translation = {0.9, 0.1, 0.0};
    const Compound club =
        Compound::create(std::vector<CompoundPart>{{Box{{0.7, 0.2, 0.2}}, {}}, knob}).value();
    const std::array<Shape, 5> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 0.6, 0.5}}, wedge,
                                      club};
    for (int i = 0; i < 15; ++i) {
        BodyState state;
        const int row = i / 3 % 2, layer = i / 6;
        const double x = 1.3 * (i % 3), y = 1.1 * row;
        state.pose.translation = {x, y, source->height(x, y) + 3.0 + 1.2 * layer};
        state.velocity = {0.5 * (i % 4), -1.0, -3.0 * (i % 5)};
        state.angular_velocity = {0.5 * i, 1.0, -2.0};
        ASSERT_TRUE(world.add({.shape = shapes[static_cast<std::size_t>(i) % shapes.size()]}, state)
                        .has_value());
    }
    std::uint64_t pairs = 0;
    for (int step = 0; step < 60; ++step) {
        pager.update({}, world.needs(), step / 60.0);
        pairs +=
            world.step(Ground(pager.resident(), pager.contact_level()), 1.0 / 60.0).touching_pairs;
    }
    EXPECT_GT(pairs, 100u);
    EXPECT_EQ(world.state_hash(), 0x1741451deec80cfdu) << std::hex << world.state_hash();
}

TEST(GoldenVehicles, AreTheSameWithEveryCompilerAtEveryLevel) {
    const auto source = FractalHeights::create({.seed = 12, .root_size_log2 = 12}).value();
    Pager pager = Pager::create(source, {.worker_count = 0, .horizon = 0.1}).value();
    const auto pose_over = [&](double x, double y, double height) {
        Pose pose;
        pose.translation = {x, y, source->height(x, y) + height};
        return pose;
    };
    World world = World::create({}).value();
    const BodyId truck = world.add_vehicle(make_truck(), pose_over(0.0, 0.0, 2.0)).value();
    const BodyId tracked = world.add_vehicle(make_tracked(), pose_over(0.0, 30.0, 2.0)).value();
    const BodyId six = world.add_vehicle(make_six_wheeler(), pose_over(0.0, 50.0, 2.5)).value();
    const BodyId walker = world.add_character({}, pose_over(8.0, 20.0, 1.2).translation).value();
    PathDriver driver =
        PathDriver::create({{0.0, 0.0}, {20.0, 2.0}, {30.0, 15.0}, {25.0, 60.0}}, {}).value();
    for (int step = 0; step < 240; ++step) {
        pager.update({}, world.needs(), step / 60.0);
        const Ground ground(pager.resident(), pager.contact_level());
        const double turn = step < 120 ? 0.3 : -0.6;
        ASSERT_TRUE(world.set_controls(
            truck, driver.drive(*world.vehicle_settings(truck), *world.vehicle(truck))));
        ASSERT_TRUE(world.set_controls(tracked, {.throttle = 0.8, .steer = turn}));
        ASSERT_TRUE(world.set_controls(six, {.throttle = 0.5, .steer = turn}));
        CharacterControls pace;
        pace.velocity = {2.0, step < 120 ? 1.0 : -1.0};
        pace.jump_speed = step == 90 ? 3.0 : 0.0;
        ASSERT_TRUE(world.set_controls(walker, pace));
        EXPECT_EQ(world.step(ground, 1.0 / 60.0).parked, 0u);
    }
    EXPECT_GT(world.vehicle(truck)->chassis.velocity.norm(), 1.0);
    EXPECT_EQ(world.state_hash(), 0x8a35d4495aaed353u) << std::hex << world.state_hash();
}

}  // namespace golden_bodies_test
}  // namespace terrane
