// SPDX-License-Identifier: MIT
#include "collision/world/lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace terrane::character_test {

using namespace test;

/// Distance lost while accelerating from rest: without a surface map the friction of feet is 1.8.
double start_lag(double speed) {
    const CharacterSettings settings;
    const double acceleration = std::min(settings.strength / settings.mass, 1.8 * kGravity);
    return 0.5 * speed * speed / acceleration;
}

Ground make_slope(double slope) {
    return make_test_ground([slope](double x, double) { return slope * x; }, {.quantum = 0x1p-20});
}

Ground make_flat() { return make_slope(0.0); }

TEST(Character, WalksOnTheFlatAsFastAsItIsToldAndStops) {
    const Ground ground = make_flat();
    for (const double dt : {kStep, 0.1}) {
        LoneCharacter walker({20.0, 64.3, kTall});
        walker.walk(ground, {.velocity = {3.0, 0.0}}, 10.0, dt);
        EXPECT_NEAR(walker.place().x(), 50.0 - start_lag(3.0), 0.03);
        EXPECT_NEAR(walker.place().z(), kTall, 0.005);
        EXPECT_TRUE(walker.state().stands);
        walker.walk(ground, {}, 1.0, dt);
        const double stopped = walker.place().x();
        EXPECT_NEAR(stopped, 50.0, 0.03);
        walker.walk(ground, {}, 1.0, dt);
        EXPECT_NEAR(walker.place().x(), stopped, 1e-6);
    }
}

TEST(Character, ClimbsSlopesUpToItsLimitAndStandsOnThemWithoutCreeping) {
    for (const double angle : {10.0, 30.0, 45.0}) {
        const double slope = std::tan(angle * std::numbers::pi / 180.0);
        const Ground ground = make_slope(slope);
        LoneCharacter walker({40.3, 64.3, slope * 40.3 + 0.55 + 0.35 / std::cos(std::atan(slope))});
        walker.walk(ground, {}, 10.0);
        EXPECT_NEAR(walker.place().x(), 40.3, 1e-3) << angle;
        for (const double speed : {2.0, -2.0}) {
            walker.walk(ground, {.velocity = {speed, 0.0}}, 2.0);  // to reach full speed
            const double x = walker.place().x();
            walker.walk(ground, {.velocity = {speed, 0.0}}, 3.0);
            EXPECT_NEAR(walker.place().x(), x + 3.0 * speed, 0.02) << angle << ", " << speed;
        }
        EXPECT_TRUE(walker.state().stands) << angle;
    }
}

TEST(Character, NeverClimbsWhatIsTooSteepAndSlidesDownIt) {
    const double slope = std::tan(55.0 * std::numbers::pi / 180.0);
    const Ground ground =
        make_test_ground([slope](double x, double) { return slope * std::max(0.0, x - 60.0); },
                         {.quantum = 0x1p-20});
    LoneCharacter walker({50.0, 64.3, kTall});
    walker.walk(ground, {.velocity = {4.0, 0.0}}, 10.0);
    EXPECT_LT(walker.place().z(), kTall + 0.02);
    // Obliquely it slides along the wall.
    const double y = walker.place().y();
    walker.walk(ground, {.velocity = {3.0, 2.0}}, 5.0);
    EXPECT_NEAR(walker.place().y(), y + 10.0, 0.5);
    EXPECT_LT(walker.place().z(), kTall + 0.02);

    LoneCharacter high({80.0, 64.3, slope * 20.0 + 2.0});
    high.walk(ground, {.velocity = {3.0, 0.0}}, 10.0);
    EXPECT_LT(high.place().z(), kTall + 0.1) << "slid down against its will";
}

TEST(Character, SlidesAlongAWallAtAnAngleInsteadOfSticking) {
    const Ground ground = make_flat();
    for (const double angle : {0.2, 0.8, 1.4}) {
        LoneCharacter walker({69.0, 40.0, kTall});
        walker.add_box({0.5, 40.0, 2.0}, {70.5, 64.0, 2.0});
        const Eigen::Vector2d wanted(3.0 * std::cos(angle), 3.0 * std::sin(angle));
        walker.walk(ground, {.velocity = wanted}, 1.0 / wanted.x() + 1.0);
        const double y = walker.place().y();
        walker.walk(ground, {.velocity = wanted}, 2.0);
        EXPECT_NEAR(walker.place().y() - y, 2.0 * wanted.y(), 0.01) << angle;
        EXPECT_NEAR(walker.place().x(), 70.0 - 0.35, 0.01) << angle;
    }
}

TEST(Character, ClimbsStairsButNoWallHigherThanItsStep) {
    const Ground ground = make_flat();
    LoneCharacter walker({58.0, 64.0, kTall});
    for (int i = 0; i < 8; ++i) {
        const double top = 0.3 * (i + 1);
        walker.add_box({4.0, 2.0, 0.5 * top}, {64.0 + 0.5 * i, 64.0, 0.5 * top});
    }
    walker.walk(ground, {.velocity = {1.5, 0.0}}, 5.0);
    EXPECT_NEAR(walker.place().z(), kTall + 2.4, 0.02);
    EXPECT_GT(walker.place().x(), 64.0);
    walker.walk(ground, {.velocity = {-1.5, 0.0}}, 8.0);
    EXPECT_NEAR(walker.place().z(), kTall, 0.02) << "down again";

    for (const double height : {0.38, 0.45}) {
        LoneCharacter at_block({58.0, 64.0, kTall});
        at_block.add_box({4.0, 2.0, 0.5 * height}, {64.0, 64.0, 0.5 * height});
        at_block.walk(ground, {.velocity = {1.5, 0.0}}, 4.0);
        if (height < 0.4) {
            EXPECT_NEAR(at_block.place().z(), kTall + height, 0.02);
        } else {
            EXPECT_NEAR(at_block.place().z(), kTall, 0.02);
            EXPECT_LT(at_block.place().x(), 60.0);
        }
    }
}

TEST(Character, ClimbsStepsOfTheGroundItself) {
    for (const double height : {0.3, 0.6}) {
        const Ground ground =
            make_test_ground([height](double x, double) { return x < 6.4 ? 0.0 : height; },
                             {.spacing = 0.1, .quantum = 0x1p-20});
        LoneCharacter walker({4.0, 6.4, kTall});
        walker.walk(ground, {.velocity = {1.5, 0.0}}, 3.0);
        if (height < 0.4) {
            EXPECT_NEAR(walker.place().z(), kTall + height, 0.02);
        } else {
            EXPECT_LT(walker.place().z(), kTall + 0.05);
        }
    }
}

TEST(Character, JumpsAsHighAsItsSpeedSaysAndLands) {
    const Ground ground = make_flat();
    LoneCharacter walker({64.0, 64.0, kTall});
    walker.walk(ground, {}, 0.5);
    walker.step(ground, {.jump_speed = 5.0});
    double highest = 0.0;
    for (int step = 0; step < 120; ++step) {
        walker.step(ground, {});
        highest = std::max(highest, walker.place().z() - kTall);
    }
    EXPECT_NEAR(highest, 5.0 * 5.0 / (2.0 * 9.81), 0.03);
    EXPECT_TRUE(walker.state().stands);
}

TEST(Character, IsNeverDeepWhateverItDoesOnRoughGround) {
    SeededRandom random(31);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::sin(0.4 * x) * std::sin(0.3 * y) + 0.8 * std::sin(2.1 * x + y);
        },
        1.0, 1);
    std::vector<std::pair<Box, BodyState>> blocks(40);
    for (auto& [box, state] : blocks) {
        box.half_extents = {random.between(0.2, 2.0), random.between(0.2, 2.0), 3.0};
        state.pose.rotation = turned(random.direction());
        state.pose.translation = {random.between(10.0, 118.0), random.between(10.0, 118.0), 0.0};
    }
    for (int run = 0; run < 20; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
        const double x = random.between(40, 90), y = random.between(40, 90);
        LoneCharacter walker({x, y, 12.0});
        for (const auto& [box, state] : blocks) {
            add(walker.world(), {.shape = box, .type = BodyType::static_body}, state);
        }
        const double speed = run % 4 == 0 ? 60.0 : 6.0;
        CharacterControls controls;
        for (int step = 0; step < 300; ++step) {
            if (step % 40 == 0) {
                controls.velocity = {random.between(-speed, speed), random.between(-speed, speed)};
                controls.jump_speed = random.below(3) == 0 ? 6.0 : 0.0;
            }
            const StepReport report = walker.step(ground, controls);
            ASSERT_EQ(report.too_deep, 0u) << "step " << step;
        }
    }
}

TEST(Character, ParksWhereGroundIsMissingAndGoesOnWhenItArrives) {
    const auto flat = [](double, double) { return 0.0; };
    const Ground whole = make_test_ground(flat, {.roots = 2});
    const Ground half = make_test_ground(
        flat, {.roots = 2, .is_resident = [](int column, int) { return column == 0; }});
    LoneCharacter walker({120.0, 64.3, kTall});
    StepReport report;
    for (int i = 0; i < 300; ++i) report = walker.step(half, {.velocity = {4.0, 0.0}});
    EXPECT_EQ(report.parked, 1u);
    EXPECT_LT(walker.place().x(), 128.0);
    walker.walk(whole, {.velocity = {4.0, 0.0}}, 3.0);
    EXPECT_GT(walker.place().x(), 135.0);
}

TEST(Character, RefusesSettingsOutOfRangeByNameAndKeepsTheLastGoodControls) {
    EXPECT_NE(character_refusal({.radius = kNan}).find("radius"), std::string::npos);
    EXPECT_NE(character_refusal({.mass = 0.0}).find("mass"), std::string::npos);
    EXPECT_NE(character_refusal({.max_slope = 2.0}).find("max_slope"), std::string::npos);
    EXPECT_NE(character_refusal({}, {0, kNan, 0}).find("pose.translation.y"), std::string::npos);
    const Ground ground = make_flat();
    LoneCharacter walker({20.0, 64.3, kTall});
    walker.walk(ground, {.velocity = {3.0, 0.0}}, 1.0);
    const double x = walker.place().x();
    walker.walk(ground, {.velocity = {kNan, 0.0}}, 1.0);
    EXPECT_NEAR(walker.place().x(), x + 3.0, 1e-6);
}

TEST(Character, AllocatesNothing) {
    const Ground ground = make_slope(0.3);
    LoneCharacter walker({60.0, 64.0, 19.0});
    walker.add_box({0.5, 40.0, 9.0}, {70.5, 64.0, 20.0});
    walker.walk(ground, {.velocity = {3.0, 1.0}}, 5.0);
    const AllocationCounter counter;
    walker.walk(ground, {.velocity = {3.0, 1.0}}, 1.0);
    EXPECT_EQ(counter.count(), 0u);
}

// Characters that push and are pushed, and that ride on bodies.

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
        const double x = walker.of(crate).pose.translation.x();
        if (mass < 1000.0) {
            EXPECT_GT(x, 66.0);
            EXPECT_NEAR(walker.place().x() + 0.35 + 0.5, x, 0.05);
        } else {
            EXPECT_LT(x, 64.01);
            EXPECT_LT(walker.place().x(), 63.2);
        }
    }
}

TEST(CharacterAmongBodies, IsKnockedByABallAsMomentumSays) {
    const Ground ground = make_flat();
    LoneCharacter walker({64.0, 64.0, kTall}, {.strength = 0.0});
    walker.walk(ground, {}, 0.5);
    const BodySettings ball{
        .shape = Sphere{0.2}, .mass = 20.0, .friction = 0.0, .restitution = 0.0};
    const BodyId thrown = add(walker.world(), ball, at({62.0, 64.0, 0.9}, {20.0, 0.0, 0.0}));
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
        const Ground ground = make_test_ground(
            [](double, double) { return 0.0; },
            {.quantum = 0x1p-20,
             .surface = SurfaceMap::from_rects({}, {.friction = friction}).value()});
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

}  // namespace terrane::character_test
