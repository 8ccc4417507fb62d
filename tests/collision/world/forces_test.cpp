// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace terrane {
namespace forces_test {

using test::at;
using test::make_flat;
using test::make_world;
using test::turned;

constexpr double kStep = 1.0 / 60.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

BodyId add(World& world, const BodySettings& settings, const BodyState& state) {
    return world.add(settings, state).value();
}

const BodyState& state_of(const World& world, BodyId body) { return world.states()[body.index]; }

TEST(WorldForces, AccelerateByForceOverMassForOneStep) {
    const Ground ground = make_flat();
    for (const double dt : {kStep, 0.001, 0.1, 1.0}) {
        World world = make_world({.gravity = {0, 0, 0}});
        const BodyId body = add(world, {.mass = 4.0}, at({60.0, 60.0, 50.0}, {1.0, 0.0, 0.0}));
        ASSERT_TRUE(world.add_force(body, {2.0, 1.0, 0.0}));
        ASSERT_TRUE(world.add_force(body, {0.0, 1.0, 2.0}));
        world.step(ground, dt);
        const Eigen::Vector3d gained = dt * Eigen::Vector3d(0.5, 0.5, 0.5);
        const Eigen::Vector3d expected = Eigen::Vector3d(1.0, 0.0, 0.0) + gained;
        EXPECT_LT((state_of(world, body).velocity - expected).norm(), 1e-14) << dt;
        const Eigen::Vector3d reached = state_of(world, body).velocity;
        world.step(ground, dt);
        EXPECT_EQ(state_of(world, body).velocity, reached);
    }
}

TEST(WorldForces, AddToGravity) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body = add(world, {.mass = 2.0}, at({60.0, 60.0, 50.0}));
    for (int i = 0; i < 60; ++i) {
        ASSERT_TRUE(world.add_force(body, {0.0, 0.0, 2.0 * 9.81}));
        world.step(ground, kStep);
    }
    EXPECT_NEAR(state_of(world, body).pose.translation.z(), 50.0, 1e-12);
}

TEST(WorldForces, TurnByTorqueOverInertia) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const Box box{{0.5, 1.0, 1.5}};
    BodyState state = at({60.0, 60.0, 50.0});
    state.pose.rotation = turned({0.3, -0.7, 1.1});
    const BodyId body = add(world, {.shape = box, .mass = 3.0}, state);
    const Eigen::Vector3d torque(0.1, -0.2, 0.3);
    ASSERT_TRUE(world.add_torque(body, torque));
    const double dt = 1.0 / 240.0;
    world.step(ground, dt);
    const Eigen::Vector3d& h = box.half_extents;
    const Eigen::Vector3d inertia =
        3.0 / 3.0 *
        Eigen::Vector3d(h.y() * h.y() + h.z() * h.z(), h.x() * h.x() + h.z() * h.z(),
                        h.x() * h.x() + h.y() * h.y());
    const Eigen::Vector3d local = state.pose.rotation.transpose() * torque;
    const Eigen::Vector3d expected = state.pose.rotation * (dt * local.cwiseQuotient(inertia));
    EXPECT_LT((state_of(world, body).angular_velocity - expected).norm(), 1e-6 * expected.norm());
    EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));
    const Eigen::Vector3d before = state_of(world, body).angular_velocity;
    world.step(ground, dt);
    EXPECT_LT((state_of(world, body).angular_velocity - before).norm(), 1e-6 * before.norm());
}

TEST(WorldForces, AtAPointAreAForceAndATorqueAboutTheCentreOfMass) {
    const Ground ground = make_flat();
    World a = make_world({.gravity = {0, 0, 0}}), b = make_world({.gravity = {0, 0, 0}});
    const BodyState state = at({60.0, 60.0, 50.0});
    const BodyId in_a = add(a, {.shape = Sphere{}}, state),
                 in_b = add(b, {.shape = Sphere{}}, state);
    const Eigen::Vector3d arm(0.3, 0.1, -0.2), force(1.0, 2.0, 3.0);
    ASSERT_TRUE(a.add_force(in_a, state.pose.translation + arm, force));
    ASSERT_TRUE(b.add_force(in_b, force));
    ASSERT_TRUE(b.add_torque(in_b, arm.cross(force)));
    a.step(ground, kStep);
    b.step(ground, kStep);
    EXPECT_LT((state_of(a, in_a).angular_velocity - state_of(b, in_b).angular_velocity).norm(),
              1e-12);
    EXPECT_EQ(state_of(a, in_a).velocity, state_of(b, in_b).velocity);
    EXPECT_GT(state_of(a, in_a).angular_velocity.norm(), 0.01);
}

TEST(WorldForces, OnASleeperWakeIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    for (int i = 0; i < 120; ++i) world.step(ground, kStep);
    ASSERT_EQ(state_of(world, body).condition, BodyCondition::asleep);
    ASSERT_TRUE(world.add_force(body, {0.0, 0.0, 30.0}));
    EXPECT_EQ(state_of(world, body).condition, BodyCondition::awake);
    world.step(ground, kStep);
    EXPECT_NEAR(state_of(world, body).velocity.z(), (30.0 - 9.81) * kStep, 1e-12);
}

TEST(WorldForces, AreDroppedWhereTheBodyIsChanged) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const BodyId body = add(world, {.mass = 1e6}, at({60.0, 60.0, 50.0}));
    ASSERT_TRUE(world.add_force(body, {1e9, 0.0, 0.0}));
    ASSERT_TRUE(world.change(body, {.type = BodyType::kinematic_body}));
    world.step(ground, kStep);
    ASSERT_TRUE(world.change(body, {.mass = 1e-6}));
    world.step(ground, kStep);
    EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));
}

TEST(WorldForces, HoldABodyOnASlopeAgainstGravity) {
    const Ground ground = test::make_test_ground([](double x, double) { return x; }, 1.0, 1);
    World world = make_world();
    const BodyId body = add(world, {.shape = Sphere{0.5}, .friction = 0.0},
                            at({60.0, 60.0, 60.0 + 0.5 * std::sqrt(2.0)}));
    for (int i = 0; i < 120; ++i) {
        ASSERT_TRUE(world.add_force(body, {9.81, 0.0, 0.0}));  // its part along the slope
        EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
    }
    EXPECT_LT((state_of(world, body).velocity).norm(), 1e-9);
}

TEST(WorldForces, OutOfRangeAreRefusedAndChangeNothing) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const BodyId body = add(world, {.shape = Box{}, .mass = 2.0}, at({60.0, 60.0, 50.0}));
    const Eigen::Vector3d p(60.0, 60.0, 50.0);
    for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e300, -2.1e6}) {
        EXPECT_FALSE(world.add_force(body, {bad, 0.0, 0.0})) << bad;
        EXPECT_FALSE(world.add_force(body, p, {bad, 0.0, 0.0})) << bad;
        EXPECT_FALSE(world.add_torque(body, {0.0, bad, 0.0})) << bad;
    }
    EXPECT_FALSE(world.add_force(body, {kNan, 0.0, 0.0}, {1.0, 0.0, 0.0}));
    // The force is in range, its torque is not.
    EXPECT_FALSE(world.add_force(body, p + Eigen::Vector3d(0.0, 1e9, 0.0), {1e3, 0.0, 0.0}));
    world.step(ground, kStep);
    EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));
    EXPECT_TRUE(state_of(world, body).angular_velocity.isZero(0.0));
    // The largest ones give finite velocities.
    ASSERT_TRUE(world.add_force(body, {2e6, 0.0, 0.0}));
    world.step(ground, 1.0);
    EXPECT_NEAR(state_of(world, body).velocity.x(), 1e6, 1e-3);
    ASSERT_TRUE(world.teleport(body, at(p)));
    ASSERT_TRUE(world.add_torque(body, {3e5, 0.0, 0.0}));
    world.step(ground, 1.0);
    EXPECT_GT(state_of(world, body).angular_velocity.x(), 1e5);
    EXPECT_TRUE(state_of(world, body).angular_velocity.allFinite());
}

TEST(GravityAt, PullsBodiesTowardsThePlanetsCentre) {
    const Ground ground = make_flat();
    const Eigen::Vector3d centre(60.0, 60.0, 60.0);
    WorldSettings settings;
    settings.callbacks.gravity_at = [&](const WorldPos& place) -> Eigen::Vector3d {
        const Eigen::Vector3d arm = centre - place;
        return arm.norm() > 0.0 ? Eigen::Vector3d(9.81 / arm.norm() * arm)
                                : Eigen::Vector3d(0.0, 0.0, 0.0);
    };
    World world = make_world(settings);
    const BodyId planet =
        add(world, {.shape = Sphere{10.0}, .type = BodyType::static_body}, at(centre));
    std::vector<BodyId> bodies;
    for (const Eigen::Vector3d& side :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, -1),
          Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
        bodies.push_back(add(world, {.shape = Box{}}, at(centre + 12.0 * side)));
    }
    for (int i = 0; i < 300; ++i) {
        EXPECT_EQ(world.step(ground, kStep).failed_callbacks, 0u);
    }
    for (const BodyId body : bodies) {
        EXPECT_NEAR((state_of(world, body).pose.translation - centre).norm(), 10.5, 0.02);
        EXPECT_EQ(state_of(world, body).condition, BodyCondition::asleep);
    }
    EXPECT_TRUE(world.contains(planet));
}

TEST(GravityAt, OfZeroLetsBodiesFloat) {
    WorldSettings settings;
    settings.callbacks.gravity_at = [](const WorldPos&) { return Eigen::Vector3d(0, 0, 0); };
    World world = make_world(settings);
    const BodyId body = add(world, {}, at({60.0, 60.0, 50.0}, {0.25, 0.5, 1.0}));
    const Ground ground = make_flat();
    for (int i = 0; i < 60; ++i) world.step(ground, kStep);
    EXPECT_EQ(state_of(world, body).velocity, Eigen::Vector3d(0.25, 0.5, 1.0));
}

TEST(GravityAt, ThatThrowsOrGivesNoValidValueIsCountedAndTheSettingIsUsed) {
    const Ground ground = make_flat();
    for (int kind = 0; kind < 4; ++kind) {
        WorldSettings settings{.gravity = {0.0, 0.0, -1.0}};
        settings.callbacks.gravity_at = [kind](const WorldPos&) -> Eigen::Vector3d {
            if (kind == 0) throw std::runtime_error("no");
            if (kind == 1) throw 7;
            return {0.0, kind == 2 ? kNan : 1.1e4, 0.0};
        };
        World world = make_world(settings);
        const BodyId body = add(world, {}, at({60.0, 60.0, 50.0}));
        add(world, {}, at({70.0, 60.0, 50.0}));
        EXPECT_EQ(world.step(ground, 0.5).failed_callbacks, 2u);
        EXPECT_NEAR(state_of(world, body).velocity.z(), -0.5, 1e-12);
    }
}

}  // namespace forces_test
}  // namespace terrane
