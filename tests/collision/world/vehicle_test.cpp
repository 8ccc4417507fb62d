// SPDX-License-Identifier: MIT
#include "collision/world/lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace terrane::truck_test {

using namespace test;

Pose pose_at(double x, double y, double z) { return Pose{.translation = {x, y, z}}; }

/// Flat ground with few triangles, 2 km from the origin to each side.
Ground make_plain() {
    return make_test_ground([](double, double) { return 0.0; },
                            {.spacing = 32.0, .origin_x = -2048.0, .origin_y = -2048.0});
}

/// A truck that moves along x on a plane, at rest on its springs.
LoneVehicle make_moving(const Ground& plain, const VehicleSettings& settings, double speed) {
    LoneVehicle truck(pose_at(-1500.0, 0.0, 1.2 * settings.centre_of_mass_height), settings);
    for (int step = 0; step < 120; ++step) truck.step(plain, {.brake = 1.0}, 1.0 / 60.0);
    for (int step = 0; step < 6000 && truck.chassis().velocity.x() < speed; ++step) {
        truck.step(plain, {.throttle = 1.0}, 1.0 / 60.0);
    }
    EXPECT_GE(truck.chassis().velocity.x(), speed);
    return truck;
}

struct Manoeuvre {
    const char* name;
    VehicleControls (*controls)(double time);
};
constexpr Manoeuvre kManoeuvres[] = {
    {"full lock", [](double) { return VehicleControls{.steer = 1.0}; }},
    {"full lock and throttle",
     [](double) { return VehicleControls{.throttle = 1.0, .steer = -1.0}; }},
    {"full lock and brake", [](double) { return VehicleControls{.brake = 1.0, .steer = 1.0}; }},
    {"fishhook", [](double time) { return VehicleControls{.steer = time < 0.8 ? 1.0 : -1.0}; }},
    {"slalom",
     [](double time) { return VehicleControls{.steer = std::fmod(time, 1.2) < 0.6 ? 1.0 : -1.0}; }},
};

/// Smallest z of the up axis during a manoeuvre, that is, the largest lean.
double least_upright(LoneVehicle& truck, const Ground& plain, const Manoeuvre& manoeuvre) {
    double upright = 1.0;
    for (int step = 0; step < 360; ++step) {
        truck.step(plain, manoeuvre.controls(step / 60.0), 1.0 / 60.0);
        upright = std::min(upright, truck.chassis().pose.rotation(2, 2));
    }
    return upright;
}

TEST(Truck, SettlesOnItsSpringsAndStaysPut) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    for (const double dt : {1.0 / 60.0, 0.1}) {
        LoneVehicle truck(pose_at(64.3, 64.3, 4.0));
        for (double time = 0.0; time < 4.0; time += dt) truck.step(ground, {}, dt);
        const Eigen::Vector3d settled = truck.chassis().pose.translation;
        // Sag under the weight: g / (2 pi f)^2.
        const double omega = 6.283185307 * truck.settings().suspension_hertz;
        for (const WheelState& wheel : truck.wheels()) {
            EXPECT_TRUE(wheel.in_contact);
            EXPECT_NEAR(wheel.compression, 9.81 / (omega * omega), 0.005);
            EXPECT_NEAR(wheel.centre_world.z(), 2.0 + truck.settings().wheel_radius, 0.01);
        }
        EXPECT_NEAR(settled.z(), 2.0 + truck.settings().centre_of_mass_height, 0.01);
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
    LoneVehicle truck(start);
    for (int step = 0; step < 180; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    const Eigen::Vector3d settled = truck.chassis().pose.translation;
    for (int step = 0; step < 600; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    EXPECT_LT((truck.chassis().pose.translation - settled).norm(), 0.01);
    for (int step = 0; step < 120; ++step) truck.step(ground, {}, 1.0 / 60.0);
    EXPECT_LT(truck.chassis().velocity.x(), -2.0);
}

TEST(Truck, AcceleratesAndBrakesAsItsForcesSay) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    LoneVehicle truck(pose_at(20.0, 128.0, 0.8), VehicleSettings{.max_drive_force = 16'000.0});
    for (int step = 0; step < 120; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    for (int step = 0; step < 90; ++step) truck.step(ground, {.throttle = 1.0}, 1.0 / 60.0);
    const double gained = truck.chassis().velocity.x();
    const double expected = 1.5 * (16'000.0 / 3500.0 - 0.015 * 9.81);
    EXPECT_NEAR(gained, expected, 0.02 * expected);
    EXPECT_LT(std::abs(truck.chassis().pose.translation.y() - 128.0), 0.01);
    for (int step = 0; step < 120; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
    EXPECT_LT(std::abs(truck.chassis().velocity.x()), 0.05);
}

TEST(Truck, KeepsItsWheelsDownOnFlatGroundInFullLockFishhookAndSlalom) {
    const Ground plain = make_plain();
    VehicleSettings settings;
    settings.max_drive_force = 1e5;  // so that it reaches its speed soon
    settings.max_drive_power = 1e7;
    for (const double speed : {5.0, 10.0, 20.0, 30.0, 40.0}) {
        for (const Manoeuvre& manoeuvre : kManoeuvres) {
            LoneVehicle truck = make_moving(plain, settings, speed);
            EXPECT_GT(least_upright(truck, plain, manoeuvre), 0.99)
                << manoeuvre.name << " at " << speed << " m/s";
        }
    }
}

TEST(Truck, RollsOverInAFishhookWhereItsStaticStabilityIsBelowItsFriction) {
    const Ground plain = make_plain();
    LoneVehicle truck = make_moving(plain, VehicleSettings{.centre_of_mass_height = 1.3}, 15.0);
    least_upright(truck, plain, kManoeuvres[3]);
    EXPECT_TRUE(truck.is_rolled_over());
}

TEST(Truck, HasATopSpeedWherePowerEqualsDragAndRollingResistance) {
    const Ground plain = make_test_ground([](double, double) { return 0.0; }, {.spacing = 128.0});
    const VehicleSettings s;
    LoneVehicle truck(pose_at(100.0, 8000.0, 0.8));
    for (int step = 0; step < 60 * 200; ++step) truck.step(plain, {.throttle = 1.0}, 1.0 / 60.0);
    const double speed = truck.chassis().velocity.x();
    const double against =
        0.5 * 1.225 * s.drag_area * speed * speed + s.rolling_resistance * s.mass * 9.81;
    EXPECT_NEAR(against * speed, s.max_drive_power, 0.02 * s.max_drive_power);
    EXPECT_GT(speed, 45.0);
    EXPECT_LT(speed, 50.0);
}

TEST(Truck, CoastsToAStandstillAndIsNeverDrivenBack) {
    const Ground plain = make_plain();
    const VehicleSettings s;
    LoneVehicle truck = make_moving(plain, {}, 20.0);
    double before = truck.chassis().velocity.x();
    const double drag = 0.5 * 1.225 * s.drag_area * before * before / s.mass;
    for (int step = 0; step < 60; ++step) truck.step(plain, {}, 1.0 / 60.0);
    EXPECT_NEAR(before - truck.chassis().velocity.x(), 0.015 * 9.81 + drag, 0.05 * drag);
    before = truck.chassis().velocity.x();
    double furthest = truck.chassis().pose.translation.x();
    for (int step = 0; step < 60 * 150; ++step) {
        truck.step(plain, {}, 1.0 / 60.0);
        const double speed = truck.chassis().velocity.x();
        const double place = truck.chassis().pose.translation.x();
        ASSERT_LE(speed, before + 2e-3) << "step " << step;
        ASSERT_GE(place, furthest - 0.005) << "step " << step;  // the springs sway
        before = speed;
        furthest = std::max(furthest, place);
    }
    EXPECT_LT(before, 1e-3);
}

TEST(Truck, StaysWhereItsRollingResistanceHoldsItAndRollsWhereTheSlopeIsSteeper) {
    for (const double slope : {0.01, 0.02}) {
        const Ground ground = make_test_ground([slope](double x, double) { return slope * x; },
                                               {.roots = 2, .quantum = 0x1p-20});
        LoneVehicle truck(pose_at(128.0, 128.0, 128.0 * slope + 0.8));
        for (int step = 0; step < 240; ++step) truck.step(ground, {.brake = 1.0}, 1.0 / 60.0);
        const double settled = truck.chassis().pose.translation.x();
        for (int step = 0; step < 600; ++step) truck.step(ground, {}, 1.0 / 60.0);
        const double moved = settled - truck.chassis().pose.translation.x();
        if (slope < truck.settings().rolling_resistance) {
            EXPECT_LT(std::abs(moved), 0.01);
        } else {
            EXPECT_GT(moved, 1.0);
        }
    }
}

TEST(Truck, HasRolledOverAfterASecondOnItsRoofAndNotWhileItFlies) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    Pose start = pose_at(64.0, 64.0, 25.0);
    start.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    LoneVehicle truck(start);
    int steps = 0;
    while (truck.chassis().pose.translation.z() > 1.0 && steps < 600) {
        truck.step(ground, {}, 1.0 / 60.0);
        ++steps;
        EXPECT_FALSE(truck.is_rolled_over()) << "in flight, step " << steps;
    }
    EXPECT_GT(steps, 120);
    for (int step = 0; step < 180; ++step) truck.step(ground, {.throttle = 1.0}, 1.0 / 60.0);
    EXPECT_TRUE(truck.is_rolled_over());
    for (const WheelState& wheel : truck.wheels()) EXPECT_FALSE(wheel.in_contact);
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
        LoneVehicle truck(start);
        double lived = 0.0, lost = 0.0;
        for (int step = 0; step < 60 * 6; ++step) {
            const VehicleControls controls{
                .throttle = random.between(-1, 1), .brake = 0.0, .steer = random.between(-1, 1)};
            const StepReport report = truck.step(ground, controls, 1.0 / 60.0);
            ASSERT_EQ(report.too_deep, 0u)
                << "run " << run << " step " << step << " depth " << report.max_depth_m;
            lived += report.simulated_time;
            lost += report.lost_time;
        }
        EXPECT_LE(lost, 0.05 * (lived + lost)) << "run " << run;
    }
}

TEST(Truck, ParksWhereGroundIsMissingAndGoesOnWhenItArrives) {
    const auto flat = [](double, double) { return 2.0; };
    TableGroundSettings half{.roots = 2,
                             .is_resident = [](int column, int) { return column == 0; }};
    const Ground partly = make_test_ground(flat, half);
    const Ground whole = make_test_ground(flat, 1.0, 2);
    LoneVehicle truck(pose_at(126.5, 64.0, 3.2));
    const Eigen::Vector3d before = truck.chassis().pose.translation;
    EXPECT_EQ(truck.step(partly, {}, 1.0 / 60.0).parked, 1u);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::parked);
    EXPECT_EQ(truck.chassis().pose.translation, before);
    EXPECT_EQ(truck.step(whole, {}, 1.0 / 60.0).awake, 1u);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::awake);
}

TEST(Truck, RefusesSettingsOutOfRangeByNameAndKeepsTheLastGoodControls) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(vehicle_refusal({.mass = nan}).find("mass"), std::string::npos);
    EXPECT_NE(vehicle_refusal({}, pose_at(nan, 0.0, 0.0)).find("pose.translation.x"),
              std::string::npos);
    const std::pair<VehicleSettings, const char*> bad[] = {
        {{.centre_of_mass_height = 0.3}, "centre_of_mass_height"},
        {{.centre_of_mass_height = nan}, "centre_of_mass_height"},
        {{.max_drive_power = -1.0}, "max_drive_power"},
        {{.max_drive_power = nan}, "max_drive_power"},
        {{.rolling_resistance = 1.5}, "rolling_resistance"},
        {{.drag_area = -0.1}, "drag_area"},
        {{.drag_area = std::numeric_limits<double>::infinity()}, "drag_area"},
    };
    for (const auto& [settings, name] : bad) {
        EXPECT_NE(vehicle_refusal(settings).find(name), std::string::npos)
            << name << vehicle_refusal(settings);
    }

    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    LoneVehicle truck(pose_at(64.0, 64.0, 1.3));
    for (int step = 0; step < 60; ++step) truck.step(ground, {.throttle = 1.0}, 1.0 / 60.0);
    const double before = truck.chassis().velocity.x();
    for (int step = 0; step < 30; ++step) truck.step(ground, {.throttle = nan}, 1.0 / 60.0);
    EXPECT_GT(truck.chassis().velocity.x(), before + 1.0);
}

TEST(Truck, WithTheLargestDragAndPowerStaysFiniteAndWithoutPowerStands) {
    const Ground plain = make_plain();
    for (const VehicleSettings& settings :
         {VehicleSettings{.max_drive_force = 1e12, .max_drive_power = 1e12, .drag_area = 1e4},
          VehicleSettings{.mass = 1e-3, .drag_area = 1e4},
          VehicleSettings{.max_drive_power = 0.0}}) {
        LoneVehicle truck(pose_at(0.0, 0.0, 0.8), settings);
        for (int step = 0; step < 300; ++step) truck.step(plain, {.throttle = 1.0}, 1.0 / 60.0);
        const double speed = truck.chassis().velocity.norm();
        EXPECT_TRUE(std::isfinite(speed));
        EXPECT_LT(speed, settings.max_drive_power == 0.0 ? 1e-3 : 50.0);
    }
}

}  // namespace terrane::truck_test

namespace terrane::tracked_test {

using namespace test;

constexpr double kStep = 1.0 / 60.0;

LoneVehicle make_tracked_at(const WorldPos& place,
                            const VehicleSettings& settings = make_tracked()) {
    return LoneVehicle(Pose{.translation = place}, settings);
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

/// Heading, radians, positive to the left of east.
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
    drive(tracked, ground, {.throttle = 0.5}, 0.3);  // before power limits the force
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
    test::SeededRandom random(9);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
                   0.5 * std::sin(1.3 * x) * std::sin(1.1 * y);
        },
        1.0, 2);
    for (int run = 0; run < 6; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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

}  // namespace terrane::tracked_test
