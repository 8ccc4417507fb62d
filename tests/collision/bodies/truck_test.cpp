// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "support/table_ground.h"

#include <terrane/collision/path_driver.h>
#include <terrane/collision/truck.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

using test::make_test_ground;
using test::TableGroundSettings;

Pose pose_at(double x, double y, double z) {
    Pose pose;
    pose.translation = {x, y, z};
    return pose;
}

Truck make_truck(const Pose& start, const TruckSettings& settings = {}) {
    Result<Truck> truck = Truck::create(settings, start);
    EXPECT_TRUE(truck.has_value());
    return std::move(*truck);
}

/// Hills with bumps as high as half a wheel on them.
double bumpy(double x, double y) {
    return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
           0.25 * std::sin(1.3 * x) * std::sin(1.1 * y);
}

TEST(Truck, SettlesOnItsSpringsAndStaysPut) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    for (const double dt : {1.0 / 60.0, 0.1}) {
        Truck truck = make_truck(pose_at(64.3, 64.3, 4.0));
        for (double time = 0.0; time < 4.0; time += dt) truck.step(ground, {}, dt);
        const Eigen::Vector3d settled = truck.chassis().pose.translation;
        // Weight and springs: g / (2 pi f)^2.
        const double omega = 6.283185307 * truck.settings().suspension_hertz;
        for (const WheelState& wheel : truck.wheels()) {
            EXPECT_TRUE(wheel.on_ground);
            EXPECT_NEAR(wheel.compression, 9.81 / (omega * omega), 0.005);
            EXPECT_NEAR(wheel.centre_world.z(), 2.5, 0.01);
        }
        for (double time = 0.0; time < 5.0; time += dt) {
            const StepReport report = truck.step(ground, {}, dt);
            EXPECT_EQ(report.too_deep, 0u);
            EXPECT_EQ(report.lost_time, 0.0);
        }
        EXPECT_LT((truck.chassis().pose.translation - settled).norm(), 1e-3);
        EXPECT_LT(truck.chassis().velocity.norm(), 1e-4);
    }
}

TEST(Truck, HoldsOnASlopeWithItsBrakesAndRollsWithoutThem) {
    const double slope = 0.25;
    const Ground ground = make_test_ground([slope](double x, double) { return slope * x; }, 1.0, 2);
    Pose start = pose_at(128.0, 128.0, 128.0 * slope + 1.4);
    start.rotation =
        Motion{{}, Eigen::Vector3d::Zero(), {0.0, -std::atan(slope), 0.0}}.at(1.0).rotation;
    Truck truck = make_truck(start);
    for (int step = 0; step < 180; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    const Eigen::Vector3d settled = truck.chassis().pose.translation;
    for (int step = 0; step < 600; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    EXPECT_LT((truck.chassis().pose.translation - settled).norm(), 0.01);
    for (int step = 0; step < 120; ++step) truck.step(ground, {}, 1.0 / 60.0);
    EXPECT_LT(truck.chassis().velocity.x(), -2.0);
}

TEST(Truck, AcceleratesAndBrakesAsItsForcesSay) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    Truck truck = make_truck(pose_at(20.0, 128.0, 1.2));
    for (int step = 0; step < 120; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    for (int step = 0; step < 120; ++step) truck.step(ground, {.throttle = 1.0}, 1.0 / 60.0);
    const double gained = truck.chassis().velocity.x();
    const double expected = 2.0 * (16'000.0 / 3500.0 - 0.015 * 9.81);
    EXPECT_NEAR(gained, expected, 0.05 * expected);
    EXPECT_LT(std::abs(truck.chassis().pose.translation.y() - 128.0), 0.01);
    for (int step = 0; step < 120; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    EXPECT_LT(std::abs(truck.chassis().velocity.x()), 0.05);
}

TEST(PathDriver, TakesTheTruckAlongALineOverBumpsWithoutEverGoingDeep) {
    const Ground ground = make_test_ground(bumpy, 1.0, 2);
    for (const double dt : {1.0 / 60.0, 0.1}) {
        Truck truck = make_truck(pose_at(20.0, 60.0, bumpy(20.0, 60.0) + 1.8));
        PathDriver driver =
            PathDriver::create(
                {{20.0, 60.0}, {120.0, 60.0}, {170.0, 80.0}, {190.0, 130.0}, {190.0, 220.0}},
                {.cruise_speed = 8.0})
                .value();
        double time = 0.0, off = 0.0;
        for (; time < 90.0 && !driver.is_finished(); time += dt) {
            const StepReport report = truck.step(ground, driver.drive(truck), dt);
            ASSERT_EQ(report.too_deep, 0u)
                << "depth " << report.max_depth_m << " m at " << time << " s";
            ASSERT_EQ(report.parked, 0u);
            const Eigen::Vector3d place = truck.chassis().pose.translation;
            if (place.x() < 115.0) off = std::max(off, std::abs(place.y() - 60.0));
        }
        EXPECT_TRUE(driver.is_finished())
            << "dt " << dt << " stood at " << truck.chassis().pose.translation.transpose();
        EXPECT_LT(off, 2.0);
        EXPECT_LT(
            (truck.chassis().pose.translation.head<2>() - Eigen::Vector2d(190.0, 220.0)).norm(),
            6.0);
        EXPECT_GT(truck.chassis().pose.rotation(2, 2), 0.5) << "turned over";
    }
}

TEST(Truck, IsNeverDeepHoweverItIsThrownOntoRoughGround) {
    const std::uint64_t seed = 7;
    SCOPED_TRACE("seed 7");
    test::Random random(seed);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::floor(x / 9.0) +
                   (static_cast<int>(x * 3.0 + y * 5.0) % 4 == 0 ? 1.5 : 0.0);
        },
        1.0, 1);
    for (int run = 0; run < 12; ++run) {
        Pose start = pose_at(random.between(40, 90), random.between(40, 90), 60.0);
        start.rotation =
            Motion{{},
                   Eigen::Vector3d::Zero(),
                   {random.between(-3, 3), random.between(-3, 3), random.between(-3, 3)}}
                .at(1.0)
                .rotation;
        Truck truck = make_truck(start);
        double lived = 0.0, lost = 0.0;
        for (int step = 0; step < 60 * 6; ++step) {
            const TruckControls controls{
                .throttle = random.between(-1, 1), .brake = 0.0, .steer = random.between(-1, 1)};
            const StepReport report = truck.step(ground, controls, 1.0 / 60.0);
            ASSERT_EQ(report.too_deep, 0u)
                << "run " << run << " step " << step << " depth " << report.max_depth_m;
            lived += report.lived_time;
            lost += report.lost_time;
        }
        EXPECT_LE(lost, 0.05 * (lived + lost)) << "run " << run;
    }
}

TEST(Truck, ParksWhereGroundIsMissingAndGoesOnWhenItArrives) {
    const auto flat = [](double, double) { return 2.0; };
    TableGroundSettings half;
    half.roots = 2;
    half.is_resident = [](int column, int) { return column == 0; };
    const Ground partly = make_test_ground(flat, half);
    const Ground whole = make_test_ground(flat, 1.0, 2);
    Truck truck = make_truck(pose_at(126.5, 64.0, 3.2));
    const Eigen::Vector3d before = truck.chassis().pose.translation;
    EXPECT_EQ(truck.step(partly, {}, 1.0 / 60.0).parked, 1u);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::parked);
    EXPECT_EQ(truck.chassis().pose.translation, before);
    EXPECT_EQ(truck.step(whole, {}, 1.0 / 60.0).awake, 1u);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::awake);
}

TEST(Truck, RefusesSettingsOutOfRangeByNameAndKeepsTheLastGoodControls) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Result<Truck> refused = Truck::create({.mass = nan}, {});
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("mass"), std::string::npos);
    EXPECT_FALSE(Truck::create({}, pose_at(nan, 0.0, 0.0)).has_value());

    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    Truck truck = make_truck(pose_at(64.0, 64.0, 1.3));
    for (int step = 0; step < 60; ++step) truck.step(ground, {.throttle = 1.0}, 1.0 / 60.0);
    const double before = truck.chassis().velocity.x();
    for (int step = 0; step < 30; ++step) truck.step(ground, {.throttle = nan}, 1.0 / 60.0);
    EXPECT_GT(truck.chassis().velocity.x(), before + 1.0);
}

}  // namespace
}  // namespace terrane
