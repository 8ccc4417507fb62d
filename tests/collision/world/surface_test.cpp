// SPDX-License-Identifier: MIT
// Friction and restitution by place: bodies and tyres on a ground with a surface map.
#include "collision/bodies/body_cases.h"
#include "collision/vehicles/lone_vehicle.h"
#include "support/heights/table_ground.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/surface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {
namespace surface_test {

using test::at;
using test::make_flat;
using test::make_test_ground;
using test::make_world;
using test::TableGroundSettings;

constexpr double kGravity = 9.81;
constexpr double kStep = 1.0 / 60.0;

/// Flat ground at z = 5 with one surface west of x = 64 and another one east of it.
Ground make_two_surfaces(const SurfaceProperties& west, const SurfaceProperties& east) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const SurfaceRect eastern{{.west = 64.0, .south = -kFar, .east = kFar, .north = kFar}, east};
    TableGroundSettings settings;
    settings.surface = SurfaceMap::from_rects({&eastern, 1}, west).value();
    return make_test_ground([](double, double) { return 5.0; }, settings);
}

/// Distance along x that a box slides from a place until it stops.
double slide(const Ground& ground, double x, double speed, double friction) {
    World world = make_world({.allow_sleep = false});
    EXPECT_TRUE(world.add({.shape = Box{{0.5, 0.5, 0.25}}, .friction = friction},
                          at({x, 64.3, 5.25}, {speed, 0.0, 0.0})));
    for (int step = 0; step < 600; ++step) EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
    return world.states()[0].pose.translation.x() - x;
}

TEST(SurfaceByPlace, FrictionIsThatOfBothSurfaces) {
    constexpr double kBody = 0.4, kRoad = 0.9, kMud = 0.1, kSpeed = 3.0;
    const Ground ground = make_two_surfaces({.friction = kMud}, {.friction = kRoad});
    for (const auto& [x, surface] : {std::pair(30.0, kMud), std::pair(80.0, kRoad)}) {
        const double friction = std::sqrt(kBody * surface);
        const double distance = kSpeed * kSpeed / (2.0 * friction * kGravity);
        EXPECT_NEAR(slide(ground, x, kSpeed, kBody), distance, 0.03 * distance) << surface;
    }
}

TEST(SurfaceByPlace, DefaultsOfBothSidesAreAsWithoutAMap) {
    const double without = slide(make_flat(), 40.0, 3.0, BodySettings{}.friction);
    const double with = slide(make_two_surfaces({}, {}), 40.0, 3.0, BodySettings{}.friction);
    EXPECT_NEAR(with, without, 1e-9);
}

TEST(SurfaceByPlace, ABoxSlidesOverIceAndStopsOnTheRoadBehind) {
    const Ground ground = make_two_surfaces({.friction = 0.0}, {.friction = 1.0});
    const double distance = slide(ground, 50.0, 5.0, 0.6);
    EXPECT_GT(50.0 + distance, 63.5);
    EXPECT_LT(50.0 + distance, 63.5 + 5.0 * 5.0 / (2.0 * 0.7 * kGravity) + 0.6);
}

TEST(SurfaceByPlace, RestitutionIsTheLargerOne) {
    const Ground ground = make_two_surfaces({.restitution = 0.0}, {.restitution = 0.9});
    for (const auto& [x, least, most] : {std::tuple(30.3, 0.0, 0.1), std::tuple(80.3, 1.4, 1.8)}) {
        World world = make_world({.allow_sleep = false});
        ASSERT_TRUE(world.add({.shape = Sphere{0.5}, .restitution = 0.0}, at({x, 64.3, 7.5})));
        double highest = 0.0;
        bool has_struck = false;
        for (int step = 0; step < 90; ++step) {
            has_struck = world.step(ground, kStep).impacts > 0 || has_struck;
            if (has_struck) {
                highest = std::max(highest, world.states()[0].pose.translation.z() - 5.5);
            }
        }
        EXPECT_GE(highest, least) << x;
        EXPECT_LE(highest, most) << x;
    }
}

TEST(SurfaceByPlace, ATruckNeedsALongerWayToStopOnIce) {
    double distances[2];
    for (const int i : {0, 1}) {
        const double friction = i == 0 ? 0.05 : 0.9;
        const Ground ground = make_two_surfaces({.friction = friction}, {.friction = friction});
        test::LoneVehicle truck({Eigen::Matrix3d::Identity(), {20.0, 64.3, 5.75}});
        for (int step = 0; step < 120; ++step) truck.step(ground, {.throttle = 1.0}, kStep);
        const double start = truck.chassis().pose.translation.x();
        const double speed = truck.chassis().velocity.x();
        ASSERT_GT(speed, 1.0);
        for (int step = 0; step < 300; ++step) truck.step(ground, {.brake = 1.0}, kStep);
        // Over v^2, so that the speeds reached may differ.
        distances[i] = (truck.chassis().pose.translation.x() - start) / (speed * speed);
    }
    EXPECT_GT(distances[0], 2.5 * distances[1]);
}

}  // namespace surface_test
}  // namespace terrane
