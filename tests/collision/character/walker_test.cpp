// SPDX-License-Identifier: MIT
#include "support/allocation_counter.h"
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/walker.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane {
namespace walker_test {

using test::make_test_ground;

constexpr double kStep = 1.0 / 60.0;
constexpr double kTall = 0.9;  // of the capsule's centre above its foot

Walker make_walker(const WorldPos& place, const WalkerSettings& settings = {}) {
    Result<Walker> walker = Walker::create(settings, place);
    EXPECT_TRUE(walker.has_value());
    return std::move(*walker);
}

Ground make_slope(double slope) {
    return make_test_ground([slope](double x, double) { return slope * x; }, {.quantum = 0x1p-20});
}

/// Steps for some seconds and checks every report.
void walk(Walker& walker, const Ground& ground, std::span<const Obstacle> obstacles,
          const WalkerControls& controls, double seconds, double dt = kStep) {
    for (double time = 0.0; time < seconds - 1e-9; time += dt) {
        const StepReport report = walker.step(ground, obstacles, controls, dt);
        ASSERT_EQ(report.too_deep, 0u);
        ASSERT_EQ(report.lost_time, 0.0);
    }
}

TEST(Walker, WalksOnTheFlatAsFastAsItIsToldAndStops) {
    const Ground ground = make_slope(0.0);
    for (const double dt : {kStep, 0.1}) {
        Walker walker = make_walker({20.0, 64.3, kTall});
        walk(walker, ground, {}, {.velocity = {3.0, 0.0}}, 10.0, dt);
        EXPECT_NEAR(walker.state().place_world.x(), 50.0, 1e-6);
        EXPECT_NEAR(walker.state().place_world.z(), kTall, 0.005);
        EXPECT_TRUE(walker.state().stands);
        walk(walker, ground, {}, {}, 1.0, dt);
        EXPECT_NEAR(walker.state().place_world.x(), 50.0, 1e-6);
    }
}

TEST(Walker, ClimbsSlopesUpToItsLimitAndStandsOnThemWithoutCreeping) {
    for (const double angle : {10.0, 30.0, 45.0}) {
        const double slope = std::tan(angle * 3.14159265358979 / 180.0);
        const Ground ground = make_slope(slope);
        Walker walker =
            make_walker({40.3, 64.3, slope * 40.3 + 0.55 + 0.35 / std::cos(std::atan(slope))});
        walk(walker, ground, {}, {}, 10.0);
        EXPECT_NEAR(walker.state().place_world.x(), 40.3, 1e-3) << angle;
        walk(walker, ground, {}, {.velocity = {2.0, 0.0}}, 5.0);
        EXPECT_NEAR(walker.state().place_world.x(), 50.3, 0.05) << angle;
        walk(walker, ground, {}, {.velocity = {-2.0, 0.0}}, 5.0);
        EXPECT_NEAR(walker.state().place_world.x(), 40.3, 0.1) << "does not fly off downhill";
        EXPECT_TRUE(walker.state().stands) << angle;
    }
}

TEST(Walker, NeverClimbsWhatIsTooSteepAndSlidesDownIt) {
    const double slope = std::tan(55.0 * 3.14159265358979 / 180.0);
    const Ground ground =
        make_test_ground([slope](double x, double) { return slope * std::max(0.0, x - 60.0); },
                         {.quantum = 0x1p-20});
    Walker walker = make_walker({50.0, 64.3, kTall});
    walk(walker, ground, {}, {.velocity = {4.0, 0.0}}, 10.0);
    EXPECT_LT(walker.state().place_world.z(), kTall + 0.02);
    // At an angle it slides along the wall.
    const double y = walker.state().place_world.y();
    walk(walker, ground, {}, {.velocity = {3.0, 2.0}}, 5.0);
    EXPECT_NEAR(walker.state().place_world.y(), y + 10.0, 0.5);
    EXPECT_LT(walker.state().place_world.z(), kTall + 0.02);

    Walker high = make_walker({80.0, 64.3, slope * 20.0 + 2.0});
    walk(high, ground, {}, {.velocity = {3.0, 0.0}}, 10.0);
    EXPECT_LT(high.state().place_world.z(), kTall + 0.1) << "slid down against its will";
}

TEST(Walker, SlidesAlongAWallAtAnAngleInsteadOfSticking) {
    const Ground ground = make_slope(0.0);
    const Obstacle wall{Box{{0.5, 40.0, 2.0}}, {Eigen::Matrix3d::Identity(), {70.5, 64.0, 2.0}}};
    for (const double angle : {0.2, 0.8, 1.4}) {
        Walker walker = make_walker({69.0, 40.0, kTall});
        const Eigen::Vector2d wanted(3.0 * std::cos(angle), 3.0 * std::sin(angle));
        walk(walker, ground, {&wall, 1}, {.velocity = wanted}, 1.0 / wanted.x() + 1.0);
        const double y = walker.state().place_world.y();
        walk(walker, ground, {&wall, 1}, {.velocity = wanted}, 2.0);
        EXPECT_NEAR(walker.state().place_world.y() - y, 2.0 * wanted.y(), 0.01) << angle;
        EXPECT_NEAR(walker.state().place_world.x(), 70.0 - 0.35, 0.01) << angle;
    }
}

TEST(Walker, ClimbsStairsButNoWallHigherThanItsStep) {
    const Ground ground = make_slope(0.0);
    std::vector<Obstacle> stairs;
    for (int i = 0; i < 8; ++i) {
        const double top = 0.3 * (i + 1);
        stairs.push_back({Box{{4.0, 2.0, 0.5 * top}},
                          {Eigen::Matrix3d::Identity(), {64.0 + 0.5 * i, 64.0, 0.5 * top}}});
    }
    Walker walker = make_walker({58.0, 64.0, kTall});
    walk(walker, ground, stairs, {.velocity = {1.5, 0.0}}, 5.0);
    EXPECT_NEAR(walker.state().place_world.z(), kTall + 2.4, 0.02);
    EXPECT_GT(walker.state().place_world.x(), 64.0);
    walk(walker, ground, stairs, {.velocity = {-1.5, 0.0}}, 8.0);
    EXPECT_NEAR(walker.state().place_world.z(), kTall, 0.02) << "down again";

    for (const double height : {0.38, 0.45}) {
        const Obstacle block{Box{{4.0, 2.0, 0.5 * height}},
                             {Eigen::Matrix3d::Identity(), {64.0, 64.0, 0.5 * height}}};
        Walker at_block = make_walker({58.0, 64.0, kTall});
        walk(at_block, ground, {&block, 1}, {.velocity = {1.5, 0.0}}, 4.0);
        if (height < 0.4) {
            EXPECT_NEAR(at_block.state().place_world.z(), kTall + height, 0.02);
        } else {
            EXPECT_NEAR(at_block.state().place_world.z(), kTall, 0.02);
            EXPECT_LT(at_block.state().place_world.x(), 60.0);
        }
    }
}

TEST(Walker, ClimbsStepsOfTheGroundItself) {
    for (const double height : {0.3, 0.6}) {
        const Ground ground =
            make_test_ground([height](double x, double) { return x < 6.4 ? 0.0 : height; },
                             {.spacing = 0.1, .quantum = 0x1p-20});
        Walker walker = make_walker({4.0, 6.4, kTall});
        walk(walker, ground, {}, {.velocity = {1.5, 0.0}}, 3.0);
        if (height < 0.4) {
            EXPECT_NEAR(walker.state().place_world.z(), kTall + height, 0.02);
        } else {
            EXPECT_LT(walker.state().place_world.z(), kTall + 0.05);
        }
    }
}

TEST(Walker, IsPushedOutByAnObstacleThatMovesIntoIt) {
    const Ground ground = make_slope(0.0);
    Walker walker = make_walker({64.0, 64.0, kTall});
    Obstacle door{Box{{0.2, 2.0, 2.0}}, {Eigen::Matrix3d::Identity(), {63.0, 64.0, 2.0}}};
    for (int step = 0; step < 240; ++step) {
        door.pose.translation.x() += 0.3 * kStep;
        EXPECT_EQ(walker.step(ground, {&door, 1}, {}, kStep).too_deep, 0u);
    }
    EXPECT_NEAR(walker.state().place_world.x(), 63.0 + 0.3 * 4.0 + 0.2 + 0.35, 0.02);
}

TEST(Walker, JumpsAsHighAsItsSpeedSaysAndLands) {
    const Ground ground = make_slope(0.0);
    Walker walker = make_walker({64.0, 64.0, kTall});
    walk(walker, ground, {}, {}, 0.5);
    walker.step(ground, {}, {.jump_speed = 5.0}, kStep);
    double highest = 0.0;
    for (int step = 0; step < 120; ++step) {
        walker.step(ground, {}, {}, kStep);
        highest = std::max(highest, walker.state().place_world.z() - kTall);
    }
    EXPECT_NEAR(highest, 5.0 * 5.0 / (2.0 * 9.81), 0.03);
    EXPECT_TRUE(walker.state().stands);
}

TEST(Walker, IsNeverDeepWhateverItDoesOnRoughGround) {
    constexpr std::uint64_t kSeed = 31;
    test::Random random(kSeed);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::sin(0.4 * x) * std::sin(0.3 * y) + 0.8 * std::sin(2.1 * x + y);
        },
        1.0, 1);
    std::vector<Obstacle> obstacles;
    for (int i = 0; i < 40; ++i) {
        obstacles.push_back(
            {Box{{random.between(0.2, 2.0), random.between(0.2, 2.0), 3.0}},
             {Motion{{}, Eigen::Vector3d::Zero(), random.direction()}.at(1.0).rotation,
              {random.between(10.0, 118.0), random.between(10.0, 118.0), 0.0}}});
    }
    for (int run = 0; run < 20; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        Walker walker = make_walker({random.between(40, 90), random.between(40, 90), 12.0});
        const double speed = run % 4 == 0 ? 60.0 : 6.0;
        WalkerControls controls;
        for (int step = 0; step < 300; ++step) {
            if (step % 40 == 0) {
                controls.velocity = {random.between(-speed, speed), random.between(-speed, speed)};
                controls.jump_speed = random.below(3) == 0 ? 6.0 : 0.0;
            }
            const StepReport report = walker.step(ground, obstacles, controls, kStep);
            ASSERT_EQ(report.too_deep, 0u) << "step " << step;
        }
    }
}

TEST(Walker, ParksWhereGroundIsMissingAndGoesOnWhenItArrives) {
    const auto flat = [](double, double) { return 0.0; };
    const Ground whole = make_test_ground(flat, {.roots = 2});
    const Ground half = make_test_ground(
        flat, {.roots = 2, .is_resident = [](int column, int) { return column == 0; }});
    Walker walker = make_walker({120.0, 64.3, kTall});
    bool parked = false;
    for (int step = 0; step < 300; ++step) {
        parked = walker.step(half, {}, {.velocity = {4.0, 0.0}}, kStep).parked == 1;
    }
    EXPECT_TRUE(parked);
    EXPECT_LT(walker.state().place_world.x(), 128.0);
    walk(walker, whole, {}, {.velocity = {4.0, 0.0}}, 3.0);
    EXPECT_GT(walker.state().place_world.x(), 135.0);
}

TEST(Walker, RefusesSettingsOutOfRangeByNameAndKeepsTheLastGoodControls) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(Walker::create({.radius = nan}, {0, 0, 0}).error().message.find("radius"),
              std::string::npos);
    EXPECT_NE(Walker::create({.max_slope = 2.0}, {0, 0, 0}).error().message.find("max_slope"),
              std::string::npos);
    EXPECT_FALSE(Walker::create({}, {0, nan, 0}).has_value());
    const Ground ground = make_slope(0.0);
    Walker walker = make_walker({20.0, 64.3, kTall});
    walker.step(ground, {}, {.velocity = {3.0, 0.0}}, kStep);
    walker.step(ground, {}, {.velocity = {nan, 0.0}}, kStep);
    EXPECT_NEAR(walker.state().place_world.x(), 20.1, 1e-6);
}

TEST(Walker, AllocatesNothing) {
    const Ground ground = make_slope(0.3);
    const Obstacle wall{Box{{0.5, 40.0, 9.0}}, {Eigen::Matrix3d::Identity(), {70.5, 64.0, 20.0}}};
    Walker walker = make_walker({60.0, 64.0, 19.0});
    walk(walker, ground, {&wall, 1}, {.velocity = {3.0, 1.0}}, 5.0);
    const test::AllocationCounter counter;
    walk(walker, ground, {&wall, 1}, {.velocity = {3.0, 1.0}}, 1.0);
    EXPECT_EQ(counter.count(), 0u);
}

}  // namespace walker_test
}  // namespace terrane
