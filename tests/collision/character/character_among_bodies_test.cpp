// SPDX-License-Identifier: MIT
// Characters that push, are pushed, and ride on bodies.
#include "lone_character.h"
#include "support/heights/table_ground.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace character_among_bodies_test {

using test::kTall;
using test::LoneCharacter;
using test::make_test_ground;

constexpr double kStep = 1.0 / 60.0;

Ground make_flat() {
    return make_test_ground([](double, double) { return 0.0; }, {.quantum = 0x1p-20});
}

TEST(CharacterAmongBodies, IsPushedByAKinematicWallAndNeverThroughTheGround) {
    const Ground ground = make_flat();
    for (const double speed : {0.3, 3.0, 30.0}) {
        LoneCharacter walker({64.0, 64.0, kTall});
        const BodyId door =
            walker.add_box({0.2, 2.0, 2.0}, {63.0, 64.0, 2.0}, {.type = BodyType::kinematic_body});
        walker.walk(ground, {}, 0.5);
        ASSERT_TRUE(walker.world().set_velocity(door, {speed, 0.0, 0.0}, {0.0, 0.0, 0.0}));
        walker.walk(ground, {}, std::min(4.0, 30.0 / speed));
        const double wall = walker.of(door).pose.translation.x() + 0.2;
        EXPECT_GE(walker.place().x(), wall + 0.35 - 0.03) << speed;
        EXPECT_NEAR(walker.place().z(), kTall, 0.01) << speed;
    }
}

TEST(CharacterAmongBodies, PushesWhatItsStrengthCanMoveAndNothingHeavier) {
    const Ground ground = make_flat();
    for (const double mass : {40.0, 20'000.0}) {
        LoneCharacter walker({62.0, 64.0, kTall});
        const BodyId crate =
            walker.add_box({0.5, 0.5, 0.6}, {64.0, 64.0, 0.6}, {.mass = mass, .friction = 0.5});
        walker.walk(ground, {}, 0.5);
        walker.walk(ground, {.velocity = {1.5, 0.0}}, 6.0);
        const double moved = walker.of(crate).pose.translation.x() - 64.0;
        if (mass < 1000.0) {
            EXPECT_GT(moved, 2.0);
            EXPECT_NEAR(walker.place().x() + 0.35 + 0.5, walker.of(crate).pose.translation.x(),
                        0.05);
        } else {
            EXPECT_LT(moved, 0.01);
            EXPECT_LT(walker.place().x(), 63.2);
        }
    }
}

TEST(CharacterAmongBodies, IsKnockedByABallAsMomentumSays) {
    const Ground ground = make_flat();
    LoneCharacter walker({64.0, 64.0, kTall}, {.strength = 0.0});
    walker.walk(ground, {}, 0.5);
    BodyState ball;
    ball.pose.translation = {62.0, 64.0, 0.9};
    ball.velocity = {20.0, 0.0, 0.0};
    const BodyId thrown =
        walker.world()
            .add({.shape = Sphere{0.2}, .mass = 20.0, .friction = 0.0, .restitution = 0.0}, ball)
            .value();
    walker.walk(ground, {}, 0.2);
    EXPECT_NEAR(walker.state().body.velocity.x(), 20.0 * 20.0 / 100.0, 0.1);
    EXPECT_NEAR(walker.of(thrown).velocity.x(), 4.0, 0.2);
}

TEST(CharacterAmongBodies, RidesALiftAndATurningAndMovingPlatform) {
    const Ground ground = make_flat();
    LoneCharacter walker({64.0, 64.0, 0.5 + kTall});
    const BodyId platform =
        walker.add_box({3.0, 3.0, 0.2}, {64.0, 64.0, 0.3}, {.type = BodyType::kinematic_body});
    walker.walk(ground, {}, 0.5);
    EXPECT_EQ(walker.state().support, platform);
    const auto ride = [&](const Eigen::Vector3d& velocity, double spin, double seconds) {
        ASSERT_TRUE(walker.world().set_velocity(platform, velocity, {0.0, 0.0, spin}));
        walker.walk(ground, {}, seconds);
    };
    ride({0.0, 0.0, 2.0}, 0.0, 2.0);
    EXPECT_NEAR(walker.place().z(), 4.5 + kTall, 0.02) << "up";
    EXPECT_TRUE(walker.state().stands);
    ride({0.0, 0.0, 0.0}, 0.0, 1.0);
    ride({3.0, 0.0, 0.0}, 0.0, 2.0);
    EXPECT_NEAR(walker.place().x(), 70.0, 0.5) << "along";
    ride({0.0, 0.0, 0.0}, 0.0, 1.0);
    const Eigen::Vector3d arm = walker.place() - walker.of(platform).pose.translation;
    ride({0.0, 0.0, 0.0}, 0.5, 2.0);
    const Eigen::Vector3d turned = walker.place() - walker.of(platform).pose.translation;
    EXPECT_NEAR(turned.head<2>().norm(), arm.head<2>().norm(), 0.1) << "round";
    ride({0.0, 0.0, -2.0}, 0.0, 2.0);
    EXPECT_NEAR(walker.place().z(), 0.5 + kTall, 0.02) << "down";
    EXPECT_EQ(walker.state().support, platform);
}

TEST(CharacterAmongBodies, WalksOnAMovingPlatformRelativeToIt) {
    const Ground ground = make_flat();
    LoneCharacter walker({20.0, 64.0, 0.5 + kTall});
    const BodyId platform =
        walker.add_box({8.0, 3.0, 0.2}, {24.0, 64.0, 0.3}, {.type = BodyType::kinematic_body});
    ASSERT_TRUE(walker.world().set_velocity(platform, {4.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    walker.walk(ground, {}, 2.0);
    const double x = walker.place().x() - walker.of(platform).pose.translation.x();
    walker.walk(ground, {.velocity = {1.0, 0.0}}, 3.0);
    EXPECT_NEAR(walker.place().x() - walker.of(platform).pose.translation.x(), x + 3.0, 0.1);
}

TEST(CharacterAmongBodies, StepsOntoCratesAndPlanksThatMove) {
    const Ground ground = make_flat();
    LoneCharacter walker({58.0, 64.0, kTall});
    walker.add_box({2.0, 2.0, 0.15}, {64.0, 64.0, 0.15}, {.mass = 400.0});
    walker.walk(ground, {}, 0.5);
    walker.walk(ground, {.velocity = {1.5, 0.0}}, 4.0);
    EXPECT_NEAR(walker.place().z(), 0.3 + kTall, 0.02);
    EXPECT_TRUE(walker.state().support.is_valid());
}

TEST(CharacterAmongBodies, SlipsOnIce) {
    double distances[2];
    for (const int i : {0, 1}) {
        const double friction = i == 0 ? 0.02 : 0.6;
        test::TableGroundSettings settings;
        settings.quantum = 0x1p-20;
        settings.surface = SurfaceMap::from_rects({}, {.friction = friction}).value();
        const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
        LoneCharacter walker({20.0, 64.0, kTall});
        walker.walk(ground, {.velocity = {3.0, 0.0}}, 8.0);
        const double x = walker.place().x();
        walker.walk(ground, {}, 3.0);
        distances[i] = walker.place().x() - x;
    }
    EXPECT_GT(distances[0], 5.0 * distances[1]);
}

TEST(CharacterAmongBodies, SleepsWhenItIsAskedForNothingAndWakesWhenItIs) {
    const Ground ground = make_flat();
    LoneCharacter walker({20.0, 64.0, kTall});
    walker.walk(ground, {}, 2.0);
    EXPECT_EQ(walker.state().body.condition, BodyCondition::asleep);
    walker.walk(ground, {.velocity = {2.0, 0.0}}, 1.0);
    EXPECT_GT(walker.place().x(), 21.5);
}

}  // namespace character_among_bodies_test
}  // namespace terrane
