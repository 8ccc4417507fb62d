// SPDX-License-Identifier: MIT
#include "lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane {
namespace tracked_test {

using test::LoneVehicle;
using test::make_test_ground;
using test::vehicle_refusal;

constexpr double kStep = 1.0 / 60.0;

LoneVehicle make_tracked_at(const WorldPos& place,
                            const VehicleSettings& settings = make_tracked()) {
    Pose pose;
    pose.translation = place;
    return LoneVehicle(pose, settings);
}

Ground make_slope(double slope) {
    return make_test_ground([slope](double x, double) { return slope * x; },
                            {.roots = 2, .quantum = 0x1p-20});
}

void drive(LoneVehicle& tracked, const Ground& ground, const VehicleControls& controls,
           double seconds) {
    for (double time = 0.0; time < seconds - 1e-9; time += kStep) {
        const StepReport report = tracked.step(ground, controls, kStep);
        ASSERT_EQ(report.too_deep, 0u);
        ASSERT_EQ(report.parked, 0u);
    }
}

/// Heading, radians to the left of east.
double heading(const LoneVehicle& tracked) {
    const Eigen::Vector3d ahead = tracked.chassis().pose.rotation.col(0);
    return std::atan2(ahead.y(), ahead.x());
}

TEST(Tracked, SettlesOnItsSpringsAndStaysPut) {
    const Ground ground = make_slope(0.0);
    LoneVehicle tracked = make_tracked_at({100.0, 100.0, 2.0});
    drive(tracked, ground, {}, 5.0);
    const double omega = 6.283185307 * tracked.settings().suspension_hertz;
    for (const WheelState& wheel : tracked.wheels()) {
        EXPECT_TRUE(wheel.in_contact);
        EXPECT_NEAR(wheel.compression, 9.81 / (omega * omega), 0.005);
    }
    const WorldPos settled = tracked.chassis().pose.translation;
    drive(tracked, ground, {}, 5.0);
    EXPECT_LT((tracked.chassis().pose.translation - settled).norm(), 1e-3);
}

TEST(Tracked, AcceleratesAsItsForcesSay) {
    const Ground ground = make_slope(0.0);
    LoneVehicle tracked = make_tracked_at({60.0, 100.0, 1.2});
    drive(tracked, ground, {}, 3.0);
    drive(tracked, ground, {.throttle = 0.5}, 0.3);  // before power limits it
    const VehicleSettings& s = tracked.settings();
    const double expected = 0.3 * (0.5 * s.max_drive_force / s.mass - s.rolling_resistance * 9.81);
    EXPECT_NEAR(tracked.chassis().velocity.x(), expected, 0.02 * expected);
    EXPECT_NEAR(tracked.chassis().velocity.y(), 0.0, 0.01);
    drive(tracked, ground, {.brake = 1.0}, 5.0);
    EXPECT_LT(tracked.chassis().velocity.norm(), 0.01);
}

TEST(Tracked, HasATopSpeedWherePowerEqualsDragAndRollingResistance) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, {.spacing = 32.0});
    LoneVehicle tracked = make_tracked_at({100.0, 2000.0, 1.2});
    drive(tracked, ground, {.throttle = 1.0}, 120.0);
    const VehicleSettings& s = tracked.settings();
    const double speed = tracked.chassis().velocity.x();
    const double against =
        0.5 * 1.225 * s.drag_area * speed * speed + s.rolling_resistance * s.mass * 9.81;
    EXPECT_NEAR(against * speed, s.max_drive_power, 0.02 * s.max_drive_power);
    EXPECT_GT(speed, 17.0);
    EXPECT_LT(speed, 20.0);
}

TEST(Tracked, TurnsOnTheSpotBothWaysAlike) {
    const Ground ground = make_slope(0.0);
    double turned[2] = {};
    for (const int side : {0, 1}) {
        LoneVehicle tracked = make_tracked_at({100.0, 100.0, 1.2});
        drive(tracked, ground, {}, 3.0);
        const WorldPos from = tracked.chassis().pose.translation;
        drive(tracked, ground, {.steer = side == 0 ? 1.0 : -1.0}, 1.0);
        turned[side] = heading(tracked);
        EXPECT_LT((tracked.chassis().pose.translation - from).norm(), 0.3);
    }
    EXPECT_GT(turned[0], 0.3);
    EXPECT_NEAR(turned[0], -turned[1], 0.02 * turned[0]);
}

TEST(Tracked, DoesNotTurnWhereItsTracksHoldTheGroundAcross) {
    const Ground ground = make_slope(0.0);
    VehicleSettings settings = make_tracked();
    settings.side_grip = 1.0;
    for (AxleSettings& axle : settings.axles) axle.position *= 5.0 / 3.6;  // long and narrow
    LoneVehicle tracked = make_tracked_at({100.0, 100.0, 1.2}, settings);
    drive(tracked, ground, {}, 3.0);
    drive(tracked, ground, {.steer = 0.3}, 2.0);
    EXPECT_NEAR(heading(tracked), 0.0, 0.01);
}

TEST(Tracked, DrivesInCirclesAndClimbsASlope) {
    const Ground flat = make_slope(0.0);
    LoneVehicle circling = make_tracked_at({120.0, 120.0, 1.2});
    drive(circling, flat, {}, 2.0);
    drive(circling, flat, {.throttle = 0.3, .steer = 0.7}, 4.0);
    EXPECT_GT(std::abs(circling.chassis().angular_velocity.z()), 0.05);

    const Ground slope = make_slope(0.4);
    LoneVehicle climbing = make_tracked_at({60.0, 100.0, 0.4 * 60.0 + 1.6});
    drive(climbing, slope, {.brake = 1.0}, 3.0);
    const double x = climbing.chassis().pose.translation.x();
    drive(climbing, slope, {.brake = 1.0}, 3.0);
    EXPECT_NEAR(climbing.chassis().pose.translation.x(), x, 0.01) << "its brakes hold";
    drive(climbing, slope, {.throttle = 1.0}, 4.0);
    EXPECT_GT(climbing.chassis().pose.translation.x(), x + 5.0);
}

TEST(Tracked, IsNeverDeepHoweverItIsThrownOntoRoughGround) {
    constexpr std::uint64_t kSeed = 9;
    test::Random random(kSeed);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
                   0.5 * std::sin(1.3 * x) * std::sin(1.1 * y);
        },
        1.0, 2);
    for (int run = 0; run < 6; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        Pose pose;
        pose.rotation =
            Motion{{}, Eigen::Vector3d::Zero(), 3.0 * random.direction()}.at(1.0).rotation;
        pose.translation = {random.between(100, 150), random.between(100, 150), 12.0};
        LoneVehicle tracked(pose, make_tracked());
        for (int step = 0; step < 300; ++step) {
            const StepReport report = tracked.step(
                ground, {.throttle = random.between(-1, 1), .steer = random.between(-1, 1)}, kStep);
            ASSERT_EQ(report.too_deep, 0u) << "step " << step;
        }
    }
}

TEST(Tracked, ParksRefusesAndAllocatesNothing) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(vehicle_refusal({.mass = nan}).find("mass"), std::string::npos);
    EXPECT_NE(vehicle_refusal({.axles = {}}).find("axles"), std::string::npos);
    EXPECT_NE(vehicle_refusal({.axles = {{.track = nan}}}).find("axles[0].track"),
              std::string::npos);
    EXPECT_NE(vehicle_refusal({.max_drive_power = nan}).find("max_drive_power"), std::string::npos);
    EXPECT_NE(vehicle_refusal({.side_grip = 2.0}).find("side_grip"), std::string::npos);

    const auto flat = [](double, double) { return 0.0; };
    const Ground whole = make_test_ground(flat, {.roots = 2});
    const Ground half = make_test_ground(
        flat, {.roots = 2, .is_resident = [](int column, int) { return column == 0; }});
    LoneVehicle tracked = make_tracked_at({100.0, 64.0, 1.2});
    std::uint64_t parked = 0;
    for (int step = 0; step < 600; ++step) {
        parked = tracked.step(half, {.throttle = 0.5}, kStep).parked;
    }
    EXPECT_EQ(parked, 1u);
    EXPECT_EQ(tracked.chassis().condition, BodyCondition::parked);
    EXPECT_LT(tracked.chassis().pose.translation.x(), 128.0);
    tracked.step(whole, {.throttle = nan}, kStep);
    const test::AllocationCounter counter;
    drive(tracked, whole, {.throttle = 0.5}, 2.0);
    EXPECT_EQ(counter.count(), 0u);
    EXPECT_GT(tracked.chassis().pose.translation.x(), 128.0);
}

}  // namespace tracked_test
}  // namespace terrane
