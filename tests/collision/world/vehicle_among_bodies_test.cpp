// SPDX-License-Identifier: MIT
//
// Vehicles that drive over bodies, into bodies, and on moving bodies.
#include "collision/world/lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/vehicle.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane::vehicle_among_bodies_test {

using namespace test;

constexpr double kStep = 1.0 / 60.0;

Ground make_flat() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 4.0});
}

Pose pose_at(const WorldPos& place) { return Pose{.translation = place}; }

BodyId add_box(World& world, const Eigen::Vector3d& half_extents, const WorldPos& centre,
               BodySettings settings = {.type = BodyType::static_body}) {
    settings.shape = Box{half_extents};
    BodyState state{{.pose = pose_at(centre)}};
    return world.add(settings, state).value();
}

void drive(LoneVehicle& vehicle, const Ground& ground, const VehicleControls& controls,
           double seconds) {
    for (double time = 0.0; time < seconds - 1e-9; time += kStep) {
        const StepReport report = vehicle.step(ground, controls, kStep);
        ASSERT_EQ(report.too_deep, 0u);
    }
}

TEST(VehicleAmongBodies, TellsWhatItsWheelsStandOnAndTheirLoads) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.5}));
    const BodyId plate = add_box(truck.world(), {1.0, 3.0, 0.05}, {101.6, 100.0, 0.05});
    drive(truck, ground, {.brake = 1.0}, 3.0);
    double load = 0.0;
    for (std::size_t i = 0; i < truck.wheels().size(); ++i) {
        const WheelState& wheel = truck.wheels()[i];
        EXPECT_TRUE(wheel.in_contact);
        EXPECT_EQ(wheel.body, i < 2 ? plate : BodyId{}) << i;
        EXPECT_NEAR(wheel.normal.z(), 1.0, 1e-3);
        EXPECT_NEAR(wheel.point_world.z(), i < 2 ? 0.1 : 0.0, 0.01);
        load += wheel.load;
    }
    EXPECT_NEAR(load, truck.settings().mass * 9.81, 0.01 * truck.settings().mass * 9.81);
}

TEST(VehicleAmongBodies, CrossesABridgeOverAGap) {
    // A trench 10 m deep and 20 m wide, and planks across it.
    const Ground ground = make_test_ground(
        [](double x, double) { return x > 140.0 && x < 160.0 ? -10.0 : 0.0; }, {.spacing = 2.0});
    LoneVehicle truck(pose_at({110.0, 100.0, 1.0}));
    for (int plank = 0; plank < 12; ++plank) {
        add_box(truck.world(), {0.99, 2.0, 0.1}, {139.0 + 2.0 * plank, 100.0, 0.1});
    }
    PathDriver driver = PathDriver::create({{110.0, 100.0}, {200.0, 100.0}}, {}).value();
    double lowest = 10.0;
    for (int step = 0; step < 60 * 15; ++step) {
        ASSERT_EQ(truck.step(ground, driver.drive(truck.settings(), truck.state()), kStep).too_deep,
                  0u);
        lowest = std::min(lowest, truck.chassis().pose.translation.z());
    }
    EXPECT_TRUE(driver.is_finished());
    EXPECT_GT(lowest, 0.5);
    EXPECT_NEAR(truck.chassis().pose.translation.y(), 100.0, 0.5);
}

TEST(VehicleAmongBodies, PushesCratesAsideAndPassesThroughNone) {
    const Ground ground = make_flat();
    for (const VehicleSettings& settings : {make_truck(), make_tracked(), make_six_wheeler()}) {
        LoneVehicle vehicle(pose_at({60.0, 100.0, 1.5}), settings);
        std::vector<BodyId> crates;
        for (int i = 0; i < 12; ++i) {
            const double y = 100.0 + 0.6 * (i % 4 - 1.5);
            crates.push_back(add_box(vehicle.world(), {0.4, 0.4, 0.4}, {90.0 + 6.0 * i, y, 0.4},
                                     {.mass = 30.0}));
        }
        drive(vehicle, ground, {.throttle = 0.6}, 12.0);
        int moved = 0;
        const Shape& chassis = vehicle.world().settings(vehicle.id()).shape;
        for (std::size_t i = 0; i < crates.size(); ++i) {
            const BodyState& crate = vehicle.world().state(crates[i]);
            moved += (crate.pose.translation.head<2>() -
                      Eigen::Vector2d(90.0 + 6.0 * static_cast<double>(i),
                                      100.0 + 0.6 * (static_cast<double>(i % 4) - 1.5)))
                                 .norm() > 0.3
                         ? 1
                         : 0;
            EXPECT_GT(
                signed_distance(Box{{0.4, 0.4, 0.4}}, crate.pose, chassis, vehicle.chassis().pose)
                    .distance,
                -0.05);
        }
        EXPECT_GT(moved, 6);
        EXPECT_GT(vehicle.chassis().pose.translation.x(), 110.0);
        EXPECT_FALSE(vehicle.is_rolled_over());
    }
}

TEST(VehicleAmongBodies, IsHeldByAGuardRailAtAnySpeed) {
    const Ground ground = make_flat();
    for (const double speed : {5.0, 20.0, 45.0}) {
        LoneVehicle truck(pose_at({60.0, 100.0, 0.75}));
        add_box(truck.world(), {100.0, 0.1, 0.5}, {150.0, 106.0, 0.6});
        drive(truck, ground, {.brake = 1.0}, 1.0);
        BodyState state = truck.chassis();
        const double angle = 0.35;  // towards the rail
        state.pose.rotation << std::cos(angle), -std::sin(angle), 0.0, std::sin(angle),
            std::cos(angle), 0.0, 0.0, 0.0, 1.0;
        state.velocity = speed * state.pose.rotation.col(0);
        ASSERT_TRUE(truck.world().teleport(truck.id(), state));
        for (int step = 0; step < 300; ++step) {
            ASSERT_EQ(truck.step(ground, {}, kStep).too_deep, 0u);
            ASSERT_LT(truck.chassis().pose.translation.y(), 106.0) << speed << " m/s, " << step;
        }
    }
}

TEST(VehicleAmongBodies, RidesOnAPlatformThatMoves) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.8}));
    const BodyId ferry = add_box(truck.world(), {4.0, 3.0, 0.3}, {100.0, 100.0, 0.6},
                                 {.type = BodyType::kinematic_body});
    drive(truck, ground, {.brake = 1.0}, 3.0);
    const double x = truck.chassis().pose.translation.x();
    ASSERT_TRUE(truck.world().set_velocity(ferry, {2.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    drive(truck, ground, {.brake = 1.0}, 10.0);
    const double gone = truck.world().state(ferry).pose.translation.x() - 100.0;
    EXPECT_NEAR(gone, 20.0, 1e-6);
    EXPECT_NEAR(truck.chassis().pose.translation.x() - x, gone, 0.5);
    EXPECT_EQ(truck.wheels()[0].body, ferry);
}

TEST(VehicleAmongBodies, SleepsBrakedOnAPlankAndWakesWhenItIsRemoved) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.6}));
    const BodyId plank =
        add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    drive(truck, ground, {.brake = 1.0}, 6.0);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::asleep);
    const double z = truck.chassis().pose.translation.z();
    ASSERT_TRUE(truck.world().remove(plank));
    drive(truck, ground, {.brake = 1.0}, 2.0);
    EXPECT_LT(truck.chassis().pose.translation.z(), z - 0.3);
}

TEST(VehicleAmongBodies, LeansLessWithAntiRollBars) {
    const Ground ground =
        make_test_ground([](double, double) { return 0.0; },
                         {.spacing = 32.0, .origin_x = -2048.0, .origin_y = -2048.0});
    double upright[2];
    for (const int i : {0, 1}) {
        VehicleSettings settings;
        for (AxleSettings& axle : settings.axles) axle.anti_roll = i == 0 ? 0.0 : 60e3;
        LoneVehicle truck(pose_at({-500.0, 0.0, 0.8}), settings);
        for (int step = 0; step < 360; ++step) truck.step(ground, {.throttle = 0.7}, kStep);
        upright[i] = 1.0;
        for (int step = 0; step < 180; ++step) {
            truck.step(ground, {.throttle = 0.3, .steer = 0.4}, kStep);
            upright[i] = std::min(upright[i], truck.chassis().pose.rotation(2, 2));
        }
    }
    EXPECT_GT(1.0 - upright[0], 1.3 * (1.0 - upright[1]));
}

TEST(VehicleAmongBodies, GiveTheSameBitsWithAnyNumberOfWorkers) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.8 * std::sin(0.2 * x) * std::sin(0.17 * y); }, 1.0, 1);
    const auto run = [&](int workers) {
        test::Random random(3);
        World world = World::create({.report_contacts = true, .worker_count = workers}).value();
        std::vector<BodyId> vehicles;
        for (int i = 0; i < 4; ++i) {
            const VehicleSettings settings = i % 2 == 0 ? make_truck() : make_six_wheeler();
            vehicles.push_back(
                world.add_vehicle(settings, pose_at({40.0 + 12.0 * i, 40.0, 2.5})).value());
        }
        for (int i = 0; i < 40; ++i) {
            const double x = random.between(30.0, 100.0), y = random.between(45.0, 90.0);
            add_box(world, {0.4, 0.4, 0.4}, {x, y, 2.0}, {.mass = 40.0});
        }
        std::uint64_t hash = 0;
        const auto step = [&](int i) {
            for (const BodyId vehicle : vehicles) {
                EXPECT_TRUE(world.set_controls(
                    vehicle, VehicleControls{.throttle = 0.7, .steer = i % 120 < 60 ? 0.4 : -0.4}));
            }
            EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
            hash = hash * 31 + world.state_hash() + world.contact_events().size();
        };
        for (int i = 0; i < 300; ++i) step(i);
        return hash;
    };
    const std::uint64_t alone = run(1);
    EXPECT_EQ(run(2), alone);
    EXPECT_EQ(run(8), alone);
}

TEST(VehicleAmongBodies, AllocateNothingOnceTheyHaveTouched) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.6}), {}, {.allow_sleep = false});
    add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    drive(truck, ground, {.brake = 1.0}, 2.0);
    const test::AllocationCounter counter;
    drive(truck, ground, {.brake = 1.0}, 1.0);
    EXPECT_EQ(counter.count(), 0u);
}

}  // namespace terrane::vehicle_among_bodies_test

namespace terrane::path_driver_test {

using namespace test;

constexpr double kStep = 1.0 / 60.0;

/// Hills with bumps up to half a wheel in height.
double bumpy(double x, double y) {
    return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
           0.25 * std::sin(1.3 * x) * std::sin(1.1 * y);
}

Ground make_plain() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 16.0});
}

LoneVehicle make_truck(const WorldPos& place, const VehicleSettings& settings = {}) {
    return LoneVehicle(Pose{.translation = place}, settings);
}

PathDriver make_driver(std::vector<Eigen::Vector2d> points, double cruise_speed) {
    Result<PathDriver> driver =
        PathDriver::create(std::move(points), {.cruise_speed = cruise_speed});
    EXPECT_TRUE(driver.has_value());
    return std::move(*driver);
}

TEST(PathDriver, RefusesPathsWithoutTwoDistinctFinitePointsAndSpeedsOutOfRange) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    using Points = std::vector<Eigen::Vector2d>;
    const Points line{{0.0, 0.0}, {50.0, 0.0}};
    const std::pair<Points, const char*> bad_points[] = {
        {{}, "0 points"},
        {{{3.0, 4.0}}, "1 points"},
        {{{3.0, 4.0}, {3.0, 4.0}, {3.0, 4.0 + 1e-200}}, "3 points, 1 of them distinct"},
        {{{0.0, 0.0}, {nan, 0.0}}, "points_world[1].x"},
        {{{0.0, 0.0}, {5.0, 0.0}, {9.0, infinity}}, "points_world[2].y"},
        {{{0.0, 0.0}, {3e9, 0.0}}, "points_world[1].x"},
    };
    for (const auto& [points, said] : bad_points) {
        const Result<PathDriver> driver = PathDriver::create(points, {.cruise_speed = 5.0});
        ASSERT_FALSE(driver.has_value()) << said;
        EXPECT_EQ(driver.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(driver.error().message.find(said), std::string::npos) << driver.error().message;
    }
    for (const double speed : {nan, 0.0, -5.0, 1e4, infinity}) {
        const Result<PathDriver> driver = PathDriver::create(line, {.cruise_speed = speed});
        ASSERT_FALSE(driver.has_value()) << speed;
        EXPECT_NE(driver.error().message.find("cruise_speed"), std::string::npos);
    }
    EXPECT_FALSE(PathDriver::create(line, {.lateral_acceleration = 0.0}).has_value());
    EXPECT_FALSE(PathDriver::create(line, {.deceleration = nan}).has_value());
    EXPECT_TRUE(PathDriver::create(line, {}).has_value());
}

TEST(PathDriver, TakesTheTruckAlongALineOverBumpsWithoutEverGoingDeep) {
    const Ground ground = make_test_ground(bumpy, 1.0, 2);
    for (const double dt : {1.0 / 60.0, 0.1}) {
        LoneVehicle truck = make_truck({20.0, 60.0, bumpy(20.0, 60.0) + 1.8});
        PathDriver driver = make_driver(
            {{20.0, 60.0}, {120.0, 60.0}, {170.0, 80.0}, {190.0, 130.0}, {190.0, 220.0}}, 8.0);
        double time = 0.0, off = 0.0;
        for (; time < 90.0 && !driver.is_finished(); time += dt) {
            const StepReport report =
                truck.step(ground, driver.drive(truck.settings(), truck.state()), dt);
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

TEST(PathDriver, SlowsDownForARightAngleAndStaysOnItsWheels) {
    const Ground plain = make_plain();
    const Eigen::Vector2d corner(900.0, 1000.0);
    for (const double cruise : {5.0, 12.0, 30.0}) {
        LoneVehicle truck = make_truck({300.0, 1000.0, 0.8});
        PathDriver driver = make_driver({{300.0, 1000.0}, corner, {900.0, 1300.0}}, cruise);
        double upright = 1.0, off = 0.0, fastest = 0.0, at_corner = 0.0;
        for (int step = 0; step < 60 * 300 && !driver.is_finished(); ++step) {
            truck.step(plain, driver.drive(truck.settings(), truck.state()), kStep);
            const Eigen::Vector2d here = truck.chassis().pose.translation.head<2>();
            const double speed = truck.chassis().velocity.norm();
            upright = std::min(upright, truck.chassis().pose.rotation(2, 2));
            off = std::max(
                off, std::min(std::abs(here.x() - corner.x()), std::abs(here.y() - corner.y())));
            fastest = std::max(fastest, speed);
            if ((here - corner).norm() < 4.0) at_corner = std::max(at_corner, speed);
        }
        EXPECT_TRUE(driver.is_finished()) << cruise;
        EXPECT_GT(fastest, 0.9 * cruise);
        EXPECT_LT(at_corner, 5.5) << cruise;
        EXPECT_LT(off, 3.0) << cruise;
        EXPECT_GT(upright, 0.995) << cruise;
    }
}

TEST(PathDriver, TakesARingAtTheSpeedThatItsLateralAccelerationAllows) {
    const Ground plain = make_plain();
    std::vector<Eigen::Vector2d> ring;
    constexpr double kRadius = 40.0;
    for (int i = 0; i <= 200; ++i) {
        ring.emplace_back(1000.0 + kRadius * std::sin(0.05 * i),
                          1000.0 - kRadius * std::cos(0.05 * i));
    }
    for (const double friction : {0.8, 0.2}) {
        VehicleSettings settings{.tyre_friction = friction};
        LoneVehicle truck = make_truck({1000.0, 960.0, 0.8}, settings);
        PathDriver driver = make_driver(ring, 30.0);
        double fastest = 0.0, off = 0.0;
        for (int step = 0; step < 60 * 15; ++step) {
            truck.step(plain, driver.drive(truck.settings(), truck.state()), kStep);
            fastest = std::max(fastest, truck.chassis().velocity.norm());
            const Eigen::Vector2d here = truck.chassis().pose.translation.head<2>();
            off =
                std::max(off, std::abs((here - Eigen::Vector2d(1000.0, 1000.0)).norm() - kRadius));
        }
        const double lateral = std::min(2.5, 0.5 * 9.81 * friction);
        EXPECT_NEAR(fastest, std::sqrt(lateral * kRadius), 1.0) << "friction " << friction;
        EXPECT_LT(off, 2.0) << "friction " << friction;
    }
}

TEST(PathDriver, StopsAtTheEndOfThePathAndStaysThere) {
    const Ground plain = make_plain();
    for (const double cruise : {3.0, 12.0, 30.0}) {
        LoneVehicle truck = make_truck({300.0, 1000.0, 0.8});
        PathDriver driver = make_driver({{300.0, 1000.0}, {700.0, 1000.0}}, cruise);
        for (int step = 0; step < 60 * 240 && !driver.is_finished(); ++step) {
            EXPECT_EQ(driver.status(), DriverStatus::driving);
            truck.step(plain, driver.drive(truck.settings(), truck.state()), kStep);
        }
        for (int step = 0; step < 120; ++step)
            truck.step(plain, driver.drive(truck.settings(), truck.state()), kStep);
        EXPECT_EQ(driver.status(), DriverStatus::finished);
        EXPECT_LT(truck.chassis().velocity.norm(), 0.05) << cruise;
        EXPECT_NEAR(truck.chassis().pose.translation.x(), 700.0, 3.5) << cruise;
    }
}

TEST(PathDriver, GoesDownSlowerThanItCruises) {
    const double slope = 0.45;
    const Ground ground =
        make_test_ground([slope](double x, double) { return -slope * x; }, {.spacing = 8.0});
    const double scale = 1.0 / std::sqrt(1.0 + slope * slope);
    Pose start;
    start.rotation << scale, 0.0, slope * scale, 0.0, 1.0, 0.0, -slope * scale, 0.0, scale;
    start.translation = {100.0, 500.0, -slope * 100.0 + 1.0};
    LoneVehicle truck(start);
    PathDriver driver = make_driver({{100.0, 500.0}, {900.0, 500.0}}, 12.0);
    double fastest = 0.0;
    for (int step = 0; step < 60 * 30; ++step) {
        truck.step(ground, driver.drive(truck.settings(), truck.state()), kStep);
        fastest = std::max(fastest, truck.chassis().velocity.norm());
    }
    EXPECT_GT(fastest, 3.0);
    EXPECT_LT(fastest, 10.0);
}

TEST(PathDriver, LetsGoOfTheThrottleOnItsRoofAndSaysSo) {
    const Ground plain = make_plain();
    LoneVehicle truck(Pose{Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(), {500.0, 1000.0, 1.0}});
    PathDriver driver = make_driver({{500.0, 1000.0}, {900.0, 1000.0}}, 12.0);
    for (int step = 0; step < 180; ++step) {
        const VehicleControls controls = driver.drive(truck.settings(), truck.state());
        EXPECT_EQ(controls.throttle, 0.0) << "step " << step;
        truck.step(plain, controls, kStep);
    }
    driver.drive(truck.settings(), truck.state());
    EXPECT_EQ(driver.status(), DriverStatus::rolled_over);
    EXPECT_FALSE(driver.is_finished());

    // The same driver continues with another truck, which stands upright.
    LoneVehicle righted = make_truck({500.0, 1000.0, 0.8});
    for (int step = 0; step < 120; ++step) {
        righted.step(plain, driver.drive(righted.settings(), righted.state()), kStep);
    }
    EXPECT_EQ(driver.status(), DriverStatus::driving);
    EXPECT_GT(righted.chassis().velocity.x(), 3.0);
}

}  // namespace terrane::path_driver_test
