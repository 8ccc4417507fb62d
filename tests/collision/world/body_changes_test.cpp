// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>

// change(), teleport() and move_to().
namespace terrane {
namespace body_changes_test {

using test::at;
using test::make_flat;
using test::make_test_ground;
using test::make_world;
using test::turned;

constexpr double kStep = 1.0 / 60.0;

BodyId add(World& world, const BodySettings& settings, const BodyState& state) {
    return world.add(settings, state).value();
}

const BodyState& state_of(const World& world, BodyId body) { return world.states()[body.index]; }

void step(World& world, const Ground& ground, int count) {
    for (int i = 0; i < count; ++i) ASSERT_EQ(world.step(ground, kStep).too_deep, 0u);
}

TEST(WorldChange, OfEachFieldTakesEffect) {
    const Ground ground = make_flat();
    World world = make_world({.allow_sleep = false});
    BodySettings settings{.shape = Box{}, .mass = 2.0};
    const BodyId body = add(world, settings, at({60.0, 60.0, 5.5}));
    const auto change = [&] { ASSERT_TRUE(world.change(body, settings)); };

    settings.mass = 8.0;
    change();
    ASSERT_TRUE(world.apply_impulse(body, state_of(world, body).pose.translation, {4.0, 0, 0}));
    EXPECT_DOUBLE_EQ(state_of(world, body).velocity.x(), 0.5);

    settings.friction = 0.0;
    change();
    step(world, ground, 30);
    EXPECT_NEAR(state_of(world, body).velocity.x(), 0.5, 1e-9);
    settings.friction = 0.6;
    change();
    step(world, ground, 30);
    EXPECT_NEAR(state_of(world, body).velocity.x(), 0.0, 1e-6);

    settings.restitution = 1.0;
    change();
    ASSERT_TRUE(world.set_velocity(body, {0.0, 0.0, -3.0}, {0.0, 0.0, 0.0}));
    step(world, ground, 3);
    EXPECT_GT(state_of(world, body).velocity.z(), 2.0);

    settings.restitution = 0.0;
    settings.rotates = false;
    change();
    EXPECT_FALSE(world.set_velocity(body, {0, 0, 0}, {1.0, 0.0, 0.0}));
    ASSERT_TRUE(world.apply_angular_impulse(body, {5.0, 5.0, 5.0}));
    EXPECT_TRUE(state_of(world, body).angular_velocity.isZero(0.0));

    settings.shape = Sphere{0.25};
    settings.contact_tolerance = 0.0;
    change();
    EXPECT_DOUBLE_EQ(world.settings()[0].contact_tolerance, 0.01);
    step(world, ground, 300);
    EXPECT_NEAR(state_of(world, body).pose.translation.z(), 5.25, 0.01);
    settings.contact_tolerance = 0.002;
    change();
    EXPECT_DOUBLE_EQ(world.settings()[0].contact_tolerance, 0.002);

    const BodyId floor = add(world, {.shape = Box{{2.0, 2.0, 0.1}}, .type = BodyType::static_body},
                             at({60.0, 60.0, 9.0}));
    ASSERT_TRUE(world.teleport(body, at({60.0, 60.0, 9.4})));
    step(world, ground, 60);
    EXPECT_GT(state_of(world, body).pose.translation.z(), 9.3);
    settings.filter = {2, 2};
    change();
    step(world, ground, 120);
    EXPECT_LT(state_of(world, body).pose.translation.z(), 5.3);

    BodySettings sensor{.shape = Sphere{1.0}, .type = BodyType::static_body};
    sensor.is_sensor = true;
    ASSERT_TRUE(world.change(floor, sensor));
    EXPECT_TRUE(world.settings()[floor.index].is_sensor);
    sensor.type = BodyType::dynamic_body;
    EXPECT_FALSE(world.change(floor, sensor));
    EXPECT_TRUE(world.settings()[floor.index].is_sensor);
}

TEST(WorldChange, OfTheTypeMakesABodyStopMoveAndFall) {
    const Ground ground = make_flat();
    World world = make_world();
    BodySettings settings{.shape = test::make_hammer()};
    BodyState start = at({60.0, 60.0, 30.0}, {1.0, 0.0, 2.0}, {0.3, 0.2, 0.1});
    start.pose.rotation = turned({0.3, 0.2, 0.1});
    const BodyId body = add(world, settings, start);
    step(world, ground, 5);
    const Pose flying = state_of(world, body).pose;

    settings.type = BodyType::static_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_EQ(state_of(world, body).condition, BodyCondition::fixed);
    step(world, ground, 5);
    EXPECT_EQ(state_of(world, body).pose.translation, flying.translation);
    EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));

    settings.type = BodyType::kinematic_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_EQ(state_of(world, body).condition, BodyCondition::awake);
    ASSERT_TRUE(world.set_velocity(body, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    step(world, ground, 60);
    EXPECT_NEAR(state_of(world, body).pose.translation.x(), flying.translation.x() + 1.0, 1e-12);
    EXPECT_EQ(state_of(world, body).pose.translation.z(), flying.translation.z());

    settings.type = BodyType::dynamic_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_NEAR(state_of(world, body).velocity.x(), 1.0, 0.0);
    step(world, ground, 60);
    EXPECT_NEAR(state_of(world, body).velocity.z(), -9.81, 1e-9);
    EXPECT_NEAR(state_of(world, body).pose.translation.x(), flying.translation.x() + 2.0, 1e-9);
}

TEST(WorldChange, ToAStaticBodyKeepsWhatStandsOnIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    step(world, ground, 120);
    ASSERT_EQ(state_of(world, upper).condition, BodyCondition::asleep);
    ASSERT_TRUE(world.change(lower, {.shape = Box{}, .type = BodyType::static_body}));
    step(world, ground, 120);
    EXPECT_NEAR(state_of(world, upper).pose.translation.z(), 6.5, 0.01);
    EXPECT_EQ(state_of(world, upper).condition, BodyCondition::asleep);
    ASSERT_TRUE(world.change(lower, {.shape = Box{}}));
    EXPECT_EQ(state_of(world, upper).condition, BodyCondition::awake);
}

TEST(WorldTeleport, IntoTheGroundIsCountedOnceAndRecovers) {
    const Ground ground = make_flat();
    for (const Shape& shape : test::all_shapes(0.7)) {
        SCOPED_TRACE(test::name_of(shape));
        World world = make_world();
        const BodyId body = add(world, {.shape = shape}, at({60.0, 60.0, 8.0}));
        step(world, ground, 60);
        ASSERT_TRUE(world.teleport(body, at({64.0, 60.0, 4.0}, {0.0, 0.0, -50.0})));
        EXPECT_EQ(world.step(ground, kStep).placed_deep, 1u);
        double depth = signed_distance(shape, state_of(world, body).pose, ground, 10.0).distance;
        for (int i = 0; i < 120; ++i) {
            const StepReport report = world.step(ground, kStep);
            ASSERT_EQ(report.placed_deep, 0u);
            ASSERT_EQ(report.too_deep, 0u);
            const double now =
                signed_distance(shape, state_of(world, body).pose, ground, 10.0).distance;
            if (depth < -0.01) {
                ASSERT_GE(now, depth - 1e-9);
            }
            depth = now;
        }
        EXPECT_GT(depth, -0.01);
    }
}

TEST(WorldTeleport, OfARecoveringBodyIsSeenByOthersWhereItIs) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId deep = add(world, {.shape = Sphere{0.5}}, at({60.0, 60.0, 0.0}));
    const BodyId box = add(world, {.shape = Box{}, .mass = 0.01}, at({60.0, 60.0, 5.5}));
    step(world, ground, 300);  // it comes up under the box, which sleeps until then
    const Eigen::Vector3d between =
        state_of(world, box).pose.translation - state_of(world, deep).pose.translation;
    EXPECT_GT(state_of(world, deep).pose.translation.z(), 5.4);
    EXPECT_GT(between.norm(), 0.98);
}

TEST(WorldMoveTo, EndsAtThePoseWhereNothingIsInTheWay) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body =
        add(world, {.shape = test::make_wedge()}, at({60.0, 60.0, 20.0}, {1.0, 2.0, 3.0}));
    Pose pose = at({70.0, 50.0, 12.0}).pose;
    pose.rotation = turned({2.0, -1.0, 0.5});
    const BodyMove moved = world.move_to(body, pose, ground).value();
    EXPECT_TRUE(moved.is_resident);
    EXPECT_EQ(moved.fraction, 1.0);
    EXPECT_TRUE(state_of(world, body).pose.translation.isApprox(pose.translation, 1e-14));
    EXPECT_TRUE(state_of(world, body).pose.rotation.isApprox(pose.rotation, 1e-12));
    EXPECT_EQ(state_of(world, body).velocity, Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST(WorldMoveTo, StopsAtSlopesAndWallsWithinTheTolerance) {
    const Ground slope = make_test_ground(
        [](double x, double) { return x < 64.0 ? 5.0 : 5.0 + (x - 64.0); }, 1.0, 1);
    const Ground wall =
        make_test_ground([](double x, double) { return x < 70.0 ? 5.0 : 60.0; }, 1.0, 1);
    for (const Ground* ground : {&slope, &wall}) {
        for (const Shape& shape : test::all_shapes(0.8)) {
            SCOPED_TRACE(test::name_of(shape));
            World world = make_world();
            const BodyId body = add(world, {.shape = shape}, at({55.0, 60.0, 8.0}));
            const double tolerance = world.settings()[0].contact_tolerance;
            Pose pose = at({100.0, 60.0, 8.0}).pose;
            pose.rotation = turned({0.0, 2.0, 1.0});
            const BodyMove moved = world.move_to(body, pose, *ground).value();
            EXPECT_TRUE(moved.is_resident);
            EXPECT_GT(moved.fraction, 0.15);
            EXPECT_LT(moved.fraction, 0.4);
            const double distance =
                signed_distance(shape, state_of(world, body).pose, *ground, 10.0).distance;
            EXPECT_GT(distance, -tolerance);
            EXPECT_LT(distance, 0.01);
            EXPECT_EQ(world.step(*ground, kStep).too_deep, 0u);
        }
    }
}

TEST(WorldMoveTo, DoesNotMoveOverMissingGroundOrWhereTheBodyIsTooDeep) {
    test::TableGroundSettings settings{.roots = 2};
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground = make_test_ground([](double, double) { return 5.0; }, settings);
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({100.0, 60.0, 6.0}));
    const BodyMove moved = world.move_to(body, at({150.0, 60.0, 5.6}).pose, ground).value();
    EXPECT_FALSE(moved.is_resident);
    EXPECT_EQ(moved.fraction, 0.0);
    EXPECT_EQ(state_of(world, body).pose.translation, Eigen::Vector3d(100.0, 60.0, 6.0));

    ASSERT_TRUE(world.teleport(body, at({60.0, 60.0, 4.0})));
    const BodyMove deep = world.move_to(body, at({60.0, 60.0, 9.0}).pose, ground).value();
    EXPECT_TRUE(deep.is_resident);
    EXPECT_EQ(deep.fraction, 0.0);
    EXPECT_EQ(state_of(world, body).pose.translation.z(), 4.0);
}

TEST(WorldMoveTo, PassesThroughBodiesAndWakesTheBodyAndThoseItLeaves) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    add(world, {.shape = Box{{0.2, 5.0, 5.0}}, .type = BodyType::static_body},
        at({65.0, 60.0, 8.0}));
    step(world, ground, 120);
    ASSERT_EQ(state_of(world, upper).condition, BodyCondition::asleep);
    EXPECT_EQ(world.move_to(lower, at({75.0, 60.0, 6.0}).pose, ground)->fraction, 1.0);
    EXPECT_EQ(state_of(world, lower).condition, BodyCondition::awake);
    EXPECT_EQ(state_of(world, upper).condition, BodyCondition::awake);
    step(world, ground, 120);
    EXPECT_NEAR(state_of(world, upper).pose.translation.z(), 5.5, 0.01);
}

}  // namespace body_changes_test
}  // namespace terrane
