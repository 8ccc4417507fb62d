// SPDX-License-Identifier: MIT
#include "collision/world/lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

namespace terrane::vehicle_test {

using namespace test;

/// Flat ground with few triangles, 2 km from the origin to each side.
Ground make_plain() {
    return make_test_ground([](double, double) { return 0.0; },
                            {.spacing = 32.0, .origin_x = -2048.0, .origin_y = -2048.0});
}

Ground make_slope(double slope) {
    return make_test_ground([slope](double x, double) { return slope * x; },
                            {.roots = 2, .quantum = 0x1p-20});
}

/// A truck that moves along x on a plane, at rest on its springs.
LoneVehicle make_moving(const Ground& plain, const VehicleSettings& settings, double speed) {
    LoneVehicle truck({-1500.0, 0.0, 1.2 * settings.centre_of_mass_height}, settings);
    truck.drive(plain, {.brake = 1.0}, 2.0);
    for (int step = 0; step < 6000 && truck.chassis().velocity.x() < speed; ++step) {
        truck.step(plain, {.throttle = 1.0});
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
        truck.step(plain, manoeuvre.controls(step / 60.0));
        upright = std::min(upright, truck.chassis().pose.rotation(2, 2));
    }
    return upright;
}

TEST(Vehicles, SettleOnTheirSpringsAndStayPut) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    for (const auto& [kind, dt] : {std::pair(make_truck(), kStep), std::pair(make_truck(), 0.1),
                                   std::pair(make_tracked(), kStep)}) {
        SCOPED_TRACE(testing::Message() << kind.mass << " kg, dt " << dt);
        LoneVehicle vehicle({64.3, 64.3, 4.0}, kind);
        vehicle.drive(ground, {}, 5.0, dt);
        const WorldPos settled = vehicle.place();
        // Sag under the weight: g / (2 pi f)^2.
        const double omega = 2.0 * std::numbers::pi * kind.suspension_hertz;
        for (const WheelState& wheel : vehicle.wheels()) {
            EXPECT_TRUE(wheel.in_contact);
            EXPECT_NEAR(wheel.compression, kGravity / (omega * omega), 0.005);
            EXPECT_NEAR(wheel.centre_world.z(), 2.0 + kind.wheel_radius, 0.01);
        }
        EXPECT_NEAR(settled.z(), 2.0 + kind.centre_of_mass_height, 0.01);
        for (double time = 0.0; time < 5.0; time += dt) {
            const StepReport report = vehicle.step(ground, {}, dt);
            EXPECT_EQ(report.too_deep, 0u);
            EXPECT_EQ(report.lost_time, 0.0);
        }
        EXPECT_LT((vehicle.place() - settled).norm(), 1e-3);
        EXPECT_LT(vehicle.chassis().velocity.norm(), 1e-4);
    }
}

TEST(Vehicles, HaveATopSpeedWherePowerEqualsDragAndRollingResistance) {
    struct Case {
        VehicleSettings kind;
        double seconds;
        double least, most;  // m/s
    };
    const Ground plain = make_test_ground([](double, double) { return 0.0; }, {.spacing = 128.0});
    for (const auto& [kind, seconds, least, most] :
         {Case{make_truck(), 200.0, 45.0, 50.0}, Case{make_tracked(), 120.0, 17.0, 20.0}}) {
        LoneVehicle vehicle({100.0, 8000.0, 1.2}, kind);
        vehicle.drive(plain, {.throttle = 1.0}, seconds);
        const double speed = vehicle.chassis().velocity.x();
        const double against = 0.5 * 1.225 * kind.drag_area * speed * speed +
                               kind.rolling_resistance * kind.mass * kGravity;
        EXPECT_NEAR(against * speed, kind.max_drive_power, 0.02 * kind.max_drive_power);
        EXPECT_GT(speed, least);
        EXPECT_LT(speed, most);
    }
}

TEST(Vehicles, AccelerateAndBrakeAsTheirForcesSay) {
    const Ground ground = make_slope(0.0);
    VehicleSettings truck = make_truck();
    truck.max_drive_force = 16e3;
    // So short that power does not limit the force.
    for (const auto& [kind, throttle, seconds] :
         {std::tuple(truck, 1.0, 1.5), std::tuple(make_tracked(), 0.5, 0.3)}) {
        SCOPED_TRACE(testing::Message() << kind.mass << " kg");
        LoneVehicle vehicle({60.0, 128.0, 1.2}, kind);
        vehicle.drive(ground, {.brake = 1.0}, 3.0);
        vehicle.drive(ground, {.throttle = throttle}, seconds);
        const double expected = seconds * (throttle * kind.max_drive_force / kind.mass -
                                           kind.rolling_resistance * kGravity);
        EXPECT_NEAR(vehicle.chassis().velocity.x(), expected, 0.02 * expected);
        EXPECT_NEAR(vehicle.place().y(), 128.0, 0.01);
        vehicle.drive(ground, {.brake = 1.0}, 5.0);
        EXPECT_LT(vehicle.chassis().velocity.norm(), 0.01);
    }
}

TEST(Truck, HoldsOnASlopeWithItsBrakesAndRollsWithoutThem) {
    const double slope = 0.25;
    const Ground ground = make_test_ground([slope](double x, double) { return slope * x; }, 1.0, 2);
    const Pose start{turned({0.0, -std::atan(slope), 0.0}), {128.0, 128.0, 128.0 * slope + 1.4}};
    LoneVehicle truck(start);
    truck.drive(ground, {.brake = 1.0}, 3.0);
    const WorldPos settled = truck.place();
    truck.drive(ground, {.brake = 1.0}, 10.0);
    EXPECT_LT((truck.place() - settled).norm(), 0.01);
    truck.drive(ground, {}, 2.0);
    EXPECT_LT(truck.chassis().velocity.x(), -2.0);
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

TEST(Truck, CoastsToAStandstillAndIsNeverDrivenBack) {
    const Ground plain = make_plain();
    const VehicleSettings s;
    LoneVehicle truck = make_moving(plain, {}, 20.0);
    double before = truck.chassis().velocity.x();
    const double drag = 0.5 * 1.225 * s.drag_area * before * before / s.mass;
    truck.drive(plain, {}, 1.0);
    EXPECT_NEAR(before - truck.chassis().velocity.x(), 0.015 * kGravity + drag, 0.05 * drag);
    before = truck.chassis().velocity.x();
    double furthest = truck.place().x();
    for (int step = 0; step < 60 * 150; ++step) {
        truck.step(plain, {});
        const double speed = truck.chassis().velocity.x();
        const double place = truck.place().x();
        ASSERT_LE(speed, before + 2e-3) << "step " << step;
        ASSERT_GE(place, furthest - 0.005) << "step " << step;  // the springs sway
        before = speed;
        furthest = std::max(furthest, place);
    }
    EXPECT_LT(before, 1e-3);
}

TEST(Truck, StaysWhereItsRollingResistanceHoldsItAndRollsWhereTheSlopeIsSteeper) {
    for (const double slope : {0.01, 0.02}) {
        const Ground ground = make_slope(slope);
        LoneVehicle truck({128.0, 128.0, 128.0 * slope + 0.8});
        truck.drive(ground, {.brake = 1.0}, 4.0);
        const double settled = truck.place().x();
        truck.drive(ground, {}, 10.0);
        const double moved = settled - truck.place().x();
        if (slope < truck.settings().rolling_resistance) {
            EXPECT_LT(std::abs(moved), 0.01);
        } else {
            EXPECT_GT(moved, 1.0);
        }
    }
}

TEST(Truck, HasRolledOverAfterASecondOnItsRoofAndNotWhileItFlies) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    LoneVehicle truck(Pose{Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(), {64.0, 64.0, 25.0}});
    int steps = 0;
    while (truck.place().z() > 1.0 && steps < 600) {
        truck.step(ground, {});
        ++steps;
        EXPECT_FALSE(truck.is_rolled_over()) << "in flight, step " << steps;
    }
    EXPECT_GT(steps, 120);
    truck.drive(ground, {.throttle = 1.0}, 3.0);
    EXPECT_TRUE(truck.is_rolled_over());
    for (const WheelState& wheel : truck.wheels()) EXPECT_FALSE(wheel.in_contact);
}

TEST(Truck, IsNeverDeepHoweverItIsThrownOntoRoughGround) {
    SeededRandom random(7);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::floor(x / 9.0) +
                   (static_cast<int>(x * 3.0 + y * 5.0) % 4 == 0 ? 1.5 : 0.0);
        },
        1.0, 1);
    for (int run = 0; run < 12; ++run) {
        Pose start{.translation = {random.between(40, 90), random.between(40, 90), 60.0}};
        start.rotation =
            turned({random.between(-3, 3), random.between(-3, 3), random.between(-3, 3)});
        LoneVehicle truck(start);
        double lived = 0.0, lost = 0.0;
        for (int step = 0; step < 60 * 6; ++step) {
            const StepReport report = truck.step(
                ground, {.throttle = random.between(-1, 1), .steer = random.between(-1, 1)});
            ASSERT_EQ(report.too_deep, 0u)
                << "run " << run << " step " << step << " depth " << report.max_depth_m;
            lived += report.simulated_time;
            lost += report.lost_time;
        }
        EXPECT_LE(lost, 0.05 * (lived + lost)) << "run " << run;
    }
}

TEST(Vehicles, RefuseSettingsOutOfRangeByNameAndKeepTheLastGoodControls) {
    const Pose nowhere{.translation = {kNan, 0.0, 0.0}};
    EXPECT_NE(vehicle_refusal({}, nowhere).find("pose.translation.x"), std::string::npos);
    const std::pair<VehicleSettings, const char*> bad[] = {
        {{.mass = kNan}, "mass"},
        {{.centre_of_mass_height = 0.3}, "centre_of_mass_height"},
        {{.centre_of_mass_height = kNan}, "centre_of_mass_height"},
        {{.axles = {}}, "axles"},
        {{.axles = {{.track = kNan}}}, "axles[0].track"},
        {{.side_grip = 2.0}, "side_grip"},
        {{.max_drive_power = -1.0}, "max_drive_power"},
        {{.max_drive_power = kNan}, "max_drive_power"},
        {{.rolling_resistance = 1.5}, "rolling_resistance"},
        {{.drag_area = -0.1}, "drag_area"},
        {{.drag_area = kInfinity}, "drag_area"},
    };
    for (const auto& [settings, name] : bad) {
        EXPECT_NE(vehicle_refusal(settings).find(name), std::string::npos)
            << name << vehicle_refusal(settings);
    }

    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    LoneVehicle truck({64.0, 64.0, 1.3});
    truck.drive(ground, {.throttle = 1.0}, 1.0);
    const double before = truck.chassis().velocity.x();
    truck.drive(ground, {.throttle = kNan}, 0.5);
    EXPECT_GT(truck.chassis().velocity.x(), before + 1.0);
}

TEST(Truck, WithTheLargestDragAndPowerStaysFiniteAndWithoutPowerStands) {
    const Ground plain = make_plain();
    for (const VehicleSettings& settings :
         {VehicleSettings{.max_drive_force = 1e12, .max_drive_power = 1e12, .drag_area = 1e4},
          VehicleSettings{.mass = 1e-3, .drag_area = 1e4},
          VehicleSettings{.max_drive_power = 0.0}}) {
        LoneVehicle truck({0.0, 0.0, 0.8}, settings);
        for (int step = 0; step < 300; ++step) truck.step(plain, {.throttle = 1.0});
        const double speed = truck.chassis().velocity.norm();
        EXPECT_TRUE(std::isfinite(speed));
        EXPECT_LT(speed, settings.max_drive_power == 0.0 ? 1e-3 : 50.0);
    }
}

/// Heading, radians, positive to the left of east.
double heading(const LoneVehicle& tracked) {
    const Eigen::Vector3d ahead = tracked.chassis().pose.rotation.col(0);
    return std::atan2(ahead.y(), ahead.x());
}

TEST(Tracked, TurnsOnTheSpotBothWaysAlike) {
    const Ground ground = make_slope(0.0);
    double turned[2] = {};
    for (const int side : {0, 1}) {
        LoneVehicle tracked({100.0, 100.0, 1.2}, make_tracked());
        tracked.drive(ground, {}, 3.0);
        const WorldPos from = tracked.place();
        tracked.drive(ground, {.steer = side == 0 ? 1.0 : -1.0}, 1.0);
        turned[side] = heading(tracked);
        EXPECT_LT((tracked.place() - from).norm(), 0.3);
    }
    EXPECT_GT(turned[0], 0.3);
    EXPECT_NEAR(turned[0], -turned[1], 0.02 * turned[0]);
}

TEST(Tracked, DoesNotTurnWhereItsTracksHoldTheGroundAcross) {
    const Ground ground = make_slope(0.0);
    VehicleSettings settings = make_tracked();
    settings.side_grip = 1.0;
    for (AxleSettings& axle : settings.axles) axle.position *= 5.0 / 3.6;  // long and narrow
    LoneVehicle tracked({100.0, 100.0, 1.2}, settings);
    tracked.drive(ground, {}, 3.0);
    tracked.drive(ground, {.steer = 0.3}, 2.0);
    EXPECT_NEAR(heading(tracked), 0.0, 0.01);
}

TEST(Tracked, DrivesInCirclesAndClimbsASlope) {
    const Ground flat = make_slope(0.0);
    LoneVehicle circling({120.0, 120.0, 1.2}, make_tracked());
    circling.drive(flat, {}, 2.0);
    circling.drive(flat, {.throttle = 0.3, .steer = 0.7}, 4.0);
    EXPECT_GT(std::abs(circling.chassis().angular_velocity.z()), 0.05);

    const Ground slope = make_slope(0.4);
    LoneVehicle climbing({60.0, 100.0, 0.4 * 60.0 + 1.6}, make_tracked());
    climbing.drive(slope, {.brake = 1.0}, 3.0);
    const double x = climbing.place().x();
    climbing.drive(slope, {.brake = 1.0}, 3.0);
    EXPECT_NEAR(climbing.place().x(), x, 0.01) << "its brakes hold";
    climbing.drive(slope, {.throttle = 1.0}, 4.0);
    EXPECT_GT(climbing.place().x(), x + 5.0);
}

TEST(Tracked, IsNeverDeepHoweverItIsThrownOntoRoughGround) {
    SeededRandom random(9);
    const Ground ground = make_test_ground(
        [](double x, double y) {
            return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
                   0.5 * std::sin(1.3 * x) * std::sin(1.1 * y);
        },
        1.0, 2);
    for (int run = 0; run < 6; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
        Pose start{.rotation = turned(3.0 * random.direction())};
        start.translation = {random.between(100, 150), random.between(100, 150), 12.0};
        LoneVehicle tracked(start, make_tracked());
        for (int step = 0; step < 300; ++step) {
            const StepReport report = tracked.step(
                ground, {.throttle = random.between(-1, 1), .steer = random.between(-1, 1)});
            ASSERT_EQ(report.too_deep, 0u) << "step " << step;
        }
    }
}

TEST(Tracked, ParksWhereGroundIsMissingGoesOnWhenItArrivesAndAllocatesNothing) {
    const auto flat = [](double, double) { return 0.0; };
    const Ground whole = make_test_ground(flat, {.roots = 2});
    const Ground half = make_test_ground(
        flat, {.roots = 2, .is_resident = [](int column, int) { return column == 0; }});
    LoneVehicle tracked({100.0, 64.0, 1.2}, make_tracked());
    for (int step = 0; step < 600; ++step) tracked.step(half, {.throttle = 0.5});
    EXPECT_EQ(tracked.chassis().condition, BodyCondition::parked);
    EXPECT_LT(tracked.place().x(), 128.0);
    const WorldPos parked = tracked.place();
    EXPECT_EQ(tracked.step(half, {.throttle = 0.5}).parked, 1u);
    EXPECT_EQ(tracked.place(), parked);
    EXPECT_EQ(tracked.step(whole, {.throttle = kNan}).awake, 1u);
    const AllocationCounter counter;
    tracked.drive(whole, {.throttle = 0.5}, 2.0);
    EXPECT_EQ(counter.count(), 0u);
    EXPECT_GT(tracked.place().x(), 128.0);
}

}  // namespace terrane::vehicle_test
