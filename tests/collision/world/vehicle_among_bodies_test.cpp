// SPDX-License-Identifier: MIT
//
// Vehicles that drive over bodies, into bodies, and on moving bodies.
#include "collision/world/lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/vehicle.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace terrane::vehicle_among_bodies_test {

using namespace test;

Ground make_flat() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 4.0});
}

TEST(VehicleAmongBodies, TellsWhatItsWheelsStandOnAndTheirLoads) {
    const Ground ground = make_flat();
    LoneVehicle truck({100.0, 100.0, 1.5});
    const BodyId plate = add_box(truck.world(), {1.0, 3.0, 0.05}, {101.6, 100.0, 0.05});
    truck.drive(ground, {.brake = 1.0}, 3.0);
    double load = 0.0;
    for (std::size_t i = 0; i < truck.wheels().size(); ++i) {
        const WheelState& wheel = truck.wheels()[i];
        EXPECT_TRUE(wheel.in_contact);
        EXPECT_EQ(wheel.body, i < 2 ? plate : BodyId{}) << i;
        EXPECT_NEAR(wheel.normal.z(), 1.0, 1e-3);
        EXPECT_NEAR(wheel.point_world.z(), i < 2 ? 0.1 : 0.0, 0.01);
        load += wheel.load;
    }
    const double weight = truck.settings().mass * kGravity;
    EXPECT_NEAR(load, weight, 0.01 * weight);
}

TEST(VehicleAmongBodies, CrossesABridgeOverAGap) {
    // A trench 10 m deep and 20 m wide, and planks across it.
    const Ground ground = make_test_ground(
        [](double x, double) { return x > 140.0 && x < 160.0 ? -10.0 : 0.0; }, {.spacing = 2.0});
    LoneVehicle truck({110.0, 100.0, 1.0});
    for (int plank = 0; plank < 12; ++plank) {
        add_box(truck.world(), {0.99, 2.0, 0.1}, {139.0 + 2.0 * plank, 100.0, 0.1});
    }
    PathDriver driver = PathDriver::create({{110.0, 100.0}, {200.0, 100.0}}, {}).value();
    double lowest = 10.0;
    for (int step = 0; step < 60 * 15; ++step) {
        ASSERT_EQ(truck.follow(ground, driver).too_deep, 0u);
        lowest = std::min(lowest, truck.place().z());
    }
    EXPECT_TRUE(driver.is_finished());
    EXPECT_GT(lowest, 0.5);
    EXPECT_NEAR(truck.place().y(), 100.0, 0.5);
}

TEST(VehicleAmongBodies, PushesCratesAsideAndPassesThroughNone) {
    const Ground ground = make_flat();
    for (const VehicleSettings& settings : {make_truck(), make_tracked(), make_six_wheeler()}) {
        LoneVehicle vehicle({60.0, 100.0, 1.5}, settings);
        const Box box{{0.4, 0.4, 0.4}};
        std::vector<std::pair<BodyId, WorldPos>> crates;  // with their first places
        for (int i = 0; i < 12; ++i) {
            const WorldPos place(90.0 + 6.0 * i, 100.0 + 0.6 * (i % 4 - 1.5), 0.4);
            crates.emplace_back(add(vehicle.world(), {.shape = box, .mass = 30.0}, at(place)),
                                place);
        }
        vehicle.drive(ground, {.throttle = 0.6}, 12.0);
        int moved = 0;
        const Shape& chassis = vehicle.world().settings(vehicle.id()).shape;
        for (const auto& [id, place] : crates) {
            const Pose& crate = vehicle.world().state(id).pose;
            moved += (crate.translation - place).head<2>().norm() > 0.3;
            EXPECT_GT(signed_distance(box, crate, chassis, vehicle.chassis().pose).distance, -0.05);
        }
        EXPECT_GT(moved, 6);
        EXPECT_GT(vehicle.place().x(), 110.0);
        EXPECT_FALSE(vehicle.is_rolled_over());
    }
}

TEST(VehicleAmongBodies, IsHeldByAGuardRailAtAnySpeed) {
    const Ground ground = make_flat();
    for (const double speed : {5.0, 20.0, 45.0}) {
        LoneVehicle truck({60.0, 100.0, 0.75});
        add_box(truck.world(), {100.0, 0.1, 0.5}, {150.0, 106.0, 0.6});
        truck.drive(ground, {.brake = 1.0}, 1.0);
        BodyState state = truck.chassis();
        state.pose.rotation = turned({0.0, 0.0, 0.35});  // towards the rail
        state.velocity = speed * state.pose.rotation.col(0);
        ASSERT_TRUE(truck.world().teleport(truck.id(), state));
        for (int step = 0; step < 300; ++step) {
            ASSERT_EQ(truck.step(ground, {}).too_deep, 0u);
            ASSERT_LT(truck.place().y(), 106.0) << speed << " m/s, " << step;
        }
    }
}

TEST(VehicleAmongBodies, RidesOnAPlatformThatMoves) {
    const Ground ground = make_flat();
    LoneVehicle truck({100.0, 100.0, 1.8});
    const BodyId ferry = add_box(truck.world(), {4.0, 3.0, 0.3}, {100.0, 100.0, 0.6},
                                 {.type = BodyType::kinematic_body});
    truck.drive(ground, {.brake = 1.0}, 3.0);
    const double x = truck.place().x();
    ASSERT_TRUE(truck.world().set_velocity(ferry, {2.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    truck.drive(ground, {.brake = 1.0}, 10.0);
    const double gone = truck.world().state(ferry).pose.translation.x() - 100.0;
    EXPECT_NEAR(gone, 20.0, 1e-6);
    EXPECT_NEAR(truck.place().x() - x, gone, 0.5);
    EXPECT_EQ(truck.wheels()[0].body, ferry);
}

TEST(VehicleAmongBodies, SleepsBrakedOnAPlankAndWakesWhenItIsRemoved) {
    const Ground ground = make_flat();
    LoneVehicle truck({100.0, 100.0, 1.6});
    const BodyId plank =
        add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    truck.drive(ground, {.brake = 1.0}, 6.0);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::asleep);
    const double z = truck.place().z();
    ASSERT_TRUE(truck.world().remove(plank));
    truck.drive(ground, {.brake = 1.0}, 2.0);
    EXPECT_LT(truck.place().z(), z - 0.3);
}

TEST(VehicleAmongBodies, LeansLessWithAntiRollBars) {
    const Ground ground =
        make_test_ground([](double, double) { return 0.0; },
                         {.spacing = 32.0, .origin_x = -2048.0, .origin_y = -2048.0});
    double upright[2];
    for (const int i : {0, 1}) {
        VehicleSettings settings;
        for (AxleSettings& axle : settings.axles) axle.anti_roll = i == 0 ? 0.0 : 60e3;
        LoneVehicle truck({-500.0, 0.0, 0.8}, settings);
        for (int step = 0; step < 360; ++step) truck.step(ground, {.throttle = 0.7});
        upright[i] = 1.0;
        for (int step = 0; step < 180; ++step) {
            truck.step(ground, {.throttle = 0.3, .steer = 0.4});
            upright[i] = std::min(upright[i], truck.chassis().pose.rotation(2, 2));
        }
    }
    EXPECT_GT(1.0 - upright[0], 1.3 * (1.0 - upright[1]));
}

TEST(VehicleAmongBodies, GiveTheSameBitsWithAnyNumberOfWorkers) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.8 * std::sin(0.2 * x) * std::sin(0.17 * y); }, 1.0, 1);
    const auto run = [&](int workers) {
        Random random(3);
        World world = make_world({.report_contacts = true, .worker_count = workers});
        std::vector<BodyId> vehicles;
        for (int i = 0; i < 4; ++i) {
            const VehicleSettings settings = i % 2 == 0 ? make_truck() : make_six_wheeler();
            const Pose start{.translation = {40.0 + 12.0 * i, 40.0, 2.5}};
            vehicles.push_back(world.add_vehicle(settings, start).value());
        }
        for (int i = 0; i < 40; ++i) {
            const double x = random.between(30.0, 100.0), y = random.between(45.0, 90.0);
            add_box(world, {0.4, 0.4, 0.4}, {x, y, 2.0}, {.mass = 40.0});
        }
        std::uint64_t hash = 0;
        for (int i = 0; i < 300; ++i) {
            const VehicleControls controls{.throttle = 0.7, .steer = i % 120 < 60 ? 0.4 : -0.4};
            for (const BodyId vehicle : vehicles) {
                EXPECT_TRUE(world.set_controls(vehicle, controls));
            }
            EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
            hash = hash * 31 + world.state_hash() + world.contact_events().size();
        }
        return hash;
    };
    const std::uint64_t alone = run(1);
    EXPECT_EQ(run(2), alone);
    EXPECT_EQ(run(8), alone);
}

TEST(VehicleAmongBodies, AllocateNothingOnceTheyHaveTouched) {
    const Ground ground = make_flat();
    LoneVehicle truck({100.0, 100.0, 1.6}, {}, {.allow_sleep = false});
    add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    truck.drive(ground, {.brake = 1.0}, 2.0);
    const AllocationCounter counter;
    truck.drive(ground, {.brake = 1.0}, 1.0);
    EXPECT_EQ(counter.count(), 0u);
}

}  // namespace terrane::vehicle_among_bodies_test

namespace terrane::path_driver_test {

using namespace test;

/// Hills with bumps up to half a wheel in height.
double bumpy(double x, double y) {
    return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
           0.25 * std::sin(1.3 * x) * std::sin(1.1 * y);
}

Ground make_plain() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 16.0});
}

PathDriver make_driver(std::vector<Eigen::Vector2d> points, double cruise_speed) {
    return PathDriver::create(std::move(points), {.cruise_speed = cruise_speed}).value();
}

TEST(PathDriver, RefusesPathsWithoutTwoDistinctFinitePointsAndSpeedsOutOfRange) {
    using Points = std::vector<Eigen::Vector2d>;
    const Points line{{0.0, 0.0}, {50.0, 0.0}};
    const std::pair<Points, const char*> bad_points[] = {
        {{}, "0 points"},
        {{{3.0, 4.0}}, "1 points"},
        {{{3.0, 4.0}, {3.0, 4.0}, {3.0, 4.0 + 1e-200}}, "3 points, 1 of them distinct"},
        {{{0.0, 0.0}, {kNan, 0.0}}, "points_world[1].x"},
        {{{0.0, 0.0}, {5.0, 0.0}, {9.0, kInfinity}}, "points_world[2].y"},
        {{{0.0, 0.0}, {3e9, 0.0}}, "points_world[1].x"},
    };
    for (const auto& [points, said] : bad_points) {
        const Result<PathDriver> driver = PathDriver::create(points, {.cruise_speed = 5.0});
        ASSERT_FALSE(driver.has_value()) << said;
        EXPECT_EQ(driver.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(driver.error().message.find(said), std::string::npos) << driver.error().message;
    }
    for (const double speed : {kNan, 0.0, -5.0, 1e4, kInfinity}) {
        const Result<PathDriver> driver = PathDriver::create(line, {.cruise_speed = speed});
        ASSERT_FALSE(driver.has_value()) << speed;
        EXPECT_NE(driver.error().message.find("cruise_speed"), std::string::npos);
    }
    EXPECT_FALSE(PathDriver::create(line, {.lateral_acceleration = 0.0}).has_value());
    EXPECT_FALSE(PathDriver::create(line, {.deceleration = kNan}).has_value());
    EXPECT_TRUE(PathDriver::create(line, {}).has_value());
}

TEST(PathDriver, TakesTheTruckAlongALineOverBumpsWithoutEverGoingDeep) {
    const Ground ground = make_test_ground(bumpy, 1.0, 2);
    for (const double dt : {1.0 / 60.0, 0.1}) {
        LoneVehicle truck({20.0, 60.0, bumpy(20.0, 60.0) + 1.8});
        PathDriver driver = make_driver(
            {{20.0, 60.0}, {120.0, 60.0}, {170.0, 80.0}, {190.0, 130.0}, {190.0, 220.0}}, 8.0);
        double time = 0.0, off = 0.0;
        for (; time < 90.0 && !driver.is_finished(); time += dt) {
            const StepReport report = truck.follow(ground, driver, dt);
            ASSERT_EQ(report.too_deep, 0u)
                << "depth " << report.max_depth_m << " m at " << time << " s";
            ASSERT_EQ(report.parked, 0u);
            const WorldPos& place = truck.place();
            if (place.x() < 115.0) off = std::max(off, std::abs(place.y() - 60.0));
        }
        EXPECT_TRUE(driver.is_finished())
            << "dt " << dt << " stood at " << truck.place().transpose();
        EXPECT_LT(off, 2.0);
        EXPECT_LT((truck.place().head<2>() - Eigen::Vector2d(190.0, 220.0)).norm(), 6.0);
        EXPECT_GT(truck.chassis().pose.rotation(2, 2), 0.5) << "turned over";
    }
}

TEST(PathDriver, SlowsDownForARightAngleAndStaysOnItsWheels) {
    const Ground plain = make_plain();
    const Eigen::Vector2d corner(900.0, 1000.0);
    for (const double cruise : {5.0, 12.0, 30.0}) {
        LoneVehicle truck({300.0, 1000.0, 0.8});
        PathDriver driver = make_driver({{300.0, 1000.0}, corner, {900.0, 1300.0}}, cruise);
        double upright = 1.0, off = 0.0, fastest = 0.0, at_corner = 0.0;
        for (int step = 0; step < 60 * 300 && !driver.is_finished(); ++step) {
            truck.follow(plain, driver);
            const Eigen::Vector2d here = truck.place().head<2>();
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
        LoneVehicle truck({1000.0, 960.0, 0.8}, VehicleSettings{.tyre_friction = friction});
        PathDriver driver = make_driver(ring, 30.0);
        double fastest = 0.0, off = 0.0;
        for (int step = 0; step < 60 * 15; ++step) {
            truck.follow(plain, driver);
            fastest = std::max(fastest, truck.chassis().velocity.norm());
            const Eigen::Vector2d here = truck.place().head<2>();
            off =
                std::max(off, std::abs((here - Eigen::Vector2d(1000.0, 1000.0)).norm() - kRadius));
        }
        const double lateral = std::min(2.5, 0.5 * kGravity * friction);
        EXPECT_NEAR(fastest, std::sqrt(lateral * kRadius), 1.0) << "friction " << friction;
        EXPECT_LT(off, 2.0) << "friction " << friction;
    }
}

TEST(PathDriver, TakesATrackedVehicleUpASlopeThatItStandsAcross) {
    for (const double slope : {0.15, 0.25, 0.35}) {
        const Ground ground =
            make_test_ground([slope](double x, double) { return slope * (x - 60.0); }, 1.0, 2);
        for (const double quarter_turns : {0.5, 1.0, -1.0}) {
            SCOPED_TRACE(testing::Message() << slope << " " << quarter_turns);
            Pose start{.translation = {60.0, 128.0, 1.5}};
            start.rotation =
                Eigen::AngleAxisd(0.5 * std::numbers::pi * quarter_turns, Eigen::Vector3d::UnitZ())
                    .toRotationMatrix();
            LoneVehicle tracked(start, make_tracked());
            PathDriver driver = make_driver({{60.0, 128.0}, {110.0, 128.0}}, 6.0);
            for (int step = 0; step < 60 * 60 && !driver.is_finished(); ++step)
                tracked.follow(ground, driver);
            EXPECT_EQ(driver.status(), DriverStatus::finished);
            EXPECT_EQ(driver.stuck_time(), 0.0);
        }
    }
}

TEST(PathDriver, StopsAtTheEndOfThePathAndStaysThere) {
    const Ground plain = make_plain();
    for (const double cruise : {3.0, 12.0, 30.0}) {
        LoneVehicle truck({300.0, 1000.0, 0.8});
        PathDriver driver = make_driver({{300.0, 1000.0}, {700.0, 1000.0}}, cruise);
        for (int step = 0; step < 60 * 240 && !driver.is_finished(); ++step) {
            EXPECT_EQ(driver.status(), DriverStatus::driving);
            truck.follow(plain, driver);
        }
        for (int step = 0; step < 120; ++step) truck.follow(plain, driver);
        EXPECT_EQ(driver.status(), DriverStatus::finished);
        EXPECT_LT(truck.chassis().velocity.norm(), 0.05) << cruise;
        EXPECT_NEAR(truck.place().x(), 700.0, 3.5) << cruise;
    }
}

TEST(PathDriver, BacksOffFromAnObstacleAndGoesAroundIt) {
    const Ground plain = make_plain();
    for (const double half_width : {1.5, 4.0, 7.0}) {
        LoneVehicle truck({300.0, 1000.0, 0.8});
        add_box(truck.world(), {1.0, half_width, 2.0}, {350.0, 1000.0, 2.0});
        PathDriver driver = make_driver({{300.0, 1000.0}, {450.0, 1000.0}}, 8.0);
        bool was_stuck = false;
        double share = 0.0;
        for (int step = 0; step < 60 * 120 && !driver.is_finished(); ++step) {
            truck.follow(plain, driver);
            was_stuck |= driver.status() == DriverStatus::stuck;
            EXPECT_GE(driver.path_share(), share);
            share = driver.path_share();
        }
        EXPECT_TRUE(was_stuck) << half_width;
        EXPECT_TRUE(driver.is_finished()) << half_width << " m, " << share << " of the path";
        EXPECT_EQ(driver.path_share(), 1.0);
        EXPECT_FALSE(truck.is_rolled_over());
        EXPECT_GT(driver.stuck_time(), 5.0);
        ASSERT_TRUE(driver.stuck_place_world());
        EXPECT_NEAR(driver.stuck_place_world()->x(), 346.0, 8.0) << half_width;
    }
}

TEST(PathDriver, SaysWhenAndWhereAWallWithoutEndHoldsIt) {
    const Ground plain = make_plain();
    LoneVehicle truck({300.0, 1000.0, 0.8});
    add_box(truck.world(), {1.0, 400.0, 2.0}, {350.0, 1000.0, 2.0});
    PathDriver driver = make_driver({{300.0, 1000.0}, {450.0, 1000.0}}, 8.0);
    constexpr double kSeconds = 90.0;
    for (double time = 0.0; time < kSeconds; time += kStep) truck.follow(plain, driver);
    EXPECT_EQ(driver.status(), DriverStatus::stuck);
    EXPECT_FALSE(truck.is_rolled_over());
    EXPECT_NEAR(driver.path_share(), 46.0 / 150.0, 0.03);
    EXPECT_GT(driver.stuck_time(), kSeconds - 15.0);
    EXPECT_LT(driver.stuck_time(), kSeconds - 46.0 / 8.0);
}

TEST(PathDriver, IsNeverStuckOnAPlainHoweverSlowItIs) {
    const Ground plain = make_plain();
    for (const double cruise : {0.1, 1.0, 30.0}) {
        LoneVehicle truck({300.0, 1000.0, 0.8});
        PathDriver driver = make_driver({{300.0, 1000.0}, {700.0, 1000.0}}, cruise);
        for (int step = 0; step < 60 * 40; ++step) {
            truck.follow(plain, driver);
            ASSERT_NE(driver.status(), DriverStatus::stuck) << cruise << " at step " << step;
        }
        EXPECT_EQ(driver.stuck_time(), 0.0);
        EXPECT_FALSE(driver.stuck_place_world());
        EXPECT_GT(driver.path_share(), 0.0);
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
        truck.follow(ground, driver);
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
        const VehicleControls controls = driver.drive(truck.settings(), truck.state(), 1.0 / 60.0);
        EXPECT_EQ(controls.throttle, 0.0) << "step " << step;
        truck.step(plain, controls);
    }
    driver.drive(truck.settings(), truck.state(), 1.0 / 60.0);
    EXPECT_EQ(driver.status(), DriverStatus::rolled_over);
    EXPECT_FALSE(driver.is_finished());

    // The same driver continues with another truck, which stands upright.
    LoneVehicle righted({500.0, 1000.0, 0.8});
    for (int step = 0; step < 120; ++step) {
        righted.follow(plain, driver);
    }
    EXPECT_EQ(driver.status(), DriverStatus::driving);
    EXPECT_GT(righted.chassis().velocity.x(), 3.0);
}

}  // namespace terrane::path_driver_test
