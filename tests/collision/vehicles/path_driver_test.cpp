// SPDX-License-Identifier: MIT
#include "lone_vehicle.h"
#include "support/heights/table_ground.h"

#include <terrane/collision/vehicle.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace path_driver_test {

using test::LoneVehicle;
using test::make_test_ground;

constexpr double kStep = 1.0 / 60.0;

/// Hills with bumps up to half a wheel high.
double bumpy(double x, double y) {
    return 3.0 * std::sin(0.05 * x) * std::sin(0.04 * y) +
           0.25 * std::sin(1.3 * x) * std::sin(1.1 * y);
}

Ground make_plain() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 16.0});
}

LoneVehicle make_truck(const WorldPos& place, const VehicleSettings& settings = {}) {
    Pose pose;
    pose.translation = place;
    return LoneVehicle(pose, settings);
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
        VehicleSettings settings;
        settings.tyre_friction = friction;
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
    Pose start;
    start.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    start.translation = {500.0, 1000.0, 1.0};
    LoneVehicle truck(start);
    PathDriver driver = make_driver({{500.0, 1000.0}, {900.0, 1000.0}}, 12.0);
    for (int step = 0; step < 180; ++step) {
        const VehicleControls controls = driver.drive(truck.settings(), truck.state());
        EXPECT_EQ(controls.throttle, 0.0) << "step " << step;
        truck.step(plain, controls, kStep);
    }
    driver.drive(truck.settings(), truck.state());
    EXPECT_EQ(driver.status(), DriverStatus::rolled_over);
    EXPECT_FALSE(driver.is_finished());

    // The same driver continues with another, upright truck.
    LoneVehicle righted = make_truck({500.0, 1000.0, 0.8});
    for (int step = 0; step < 120; ++step) {
        righted.step(plain, driver.drive(righted.settings(), righted.state()), kStep);
    }
    EXPECT_EQ(driver.status(), DriverStatus::driving);
    EXPECT_GT(righted.chassis().velocity.x(), 3.0);
}

}  // namespace path_driver_test
}  // namespace terrane
