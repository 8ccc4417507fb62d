// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

// Bodies 2e9 m from the origin, where doubles are 2.4e-7 m apart, beside the same bodies near it.
namespace terrane {
namespace far_bodies_test {

constexpr double kStep = 1.0 / 60.0;
constexpr double kGrain = 0x1p-22;    // metres, the distance of doubles from 2^30 to 2^31
constexpr double kFar = 2e9 - 128.0;  // metres, a multiple of 128
constexpr double kSlope = 0.25;

/// Ground of one root square from (origin, -origin) on, whose heights are a function of the place in it.
template <class Height>
Ground make_ground(double origin, Height height) {
    test::TableGroundSettings settings;
    settings.origin_x = origin;
    settings.origin_y = -origin;
    return test::make_test_ground(
        [=](double x, double y) { return height(x - origin, y + origin); }, settings);
}

struct Fall {
    double max_depth_m = 0.0;
    double lowest_tolerance = 1.0;
    std::vector<Eigen::Vector3d> places;  // from the ground's corner
    std::vector<double> speeds;
};

/// Lets a body of each shape fall beside the others.
template <class Height>
Fall drop(double origin, Height height, double seconds) {
    const Ground ground = make_ground(origin, height);
    World world = test::make_world();
    double x = 20.0;
    Fall run;
    for (const Shape& shape : test::all_shapes()) {
        const double z = height(x, 60.0) + 3.0;
        BodySettings settings{.shape = shape};
        settings.friction = 0.6;
        const auto added = world.add(settings, test::at({origin + x, 60.0 - origin, z}));
        EXPECT_TRUE(added) << added.error().message;
        run.lowest_tolerance = std::min(run.lowest_tolerance, default_contact_tolerance(shape));
        x += 16.0;
    }
    for (int i = 0; i * kStep < seconds; ++i) {
        const StepReport report = world.step(ground, kStep);
        EXPECT_EQ(report.too_deep, 0u);
        EXPECT_EQ(report.left_world + report.parked, 0u);
        run.max_depth_m = std::max(run.max_depth_m, report.max_depth_m);
    }
    for (const BodyState& state : world.states()) {
        run.places.push_back(state.pose.translation - Eigen::Vector3d(origin, -origin, 0.0));
        run.speeds.push_back(state.velocity.norm());
    }
    return run;
}

TEST(FarBodies, RestAsDeepAsNearTheOrigin) {
    const auto flat = [](double, double) { return 5.0; };
    const Fall near = drop(0.0, flat, 4.0), far = drop(kFar, flat, 4.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
    EXPECT_NEAR(far.max_depth_m, near.max_depth_m, 64.0 * kGrain);
    for (std::size_t i = 0; i < far.places.size(); ++i) {
        // the first three shapes rest as they fall; the others tip over, and small differences grow
        EXPECT_NEAR(far.places[i].z(), near.places[i].z(), i < 3 ? 64.0 * kGrain : 1e-3) << i;
        EXPECT_LT(far.speeds[i], 1e-2) << i;
    }
}

TEST(FarBodies, RollDownASlopeAsNearTheOrigin) {
    const auto slope = [](double x, double y) { return kSlope * y + 0.01 * x; };
    const Fall near = drop(0.0, slope, 3.0), far = drop(kFar, slope, 3.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
    EXPECT_NEAR(far.max_depth_m, near.max_depth_m, 1e-3);
    const Eigen::Vector3d way = far.places[0] - near.places[0];
    EXPECT_LT(way.norm(), 1e-3) << "the sphere";
    EXPECT_LT(far.places[0].y(), 58.0) << "it rolled";
}

TEST(FarBodies, FallOnRoughGroundAndNobodyIsTooDeep) {
    const auto rough = [](double x, double y) {
        return 2.0 * std::sin(0.9 * x) * std::sin(0.7 * y) +
               (static_cast<int>(x) % 9 == 0 ? 4.0 : 0.0);
    };
    const Fall far = drop(kFar, rough, 6.0);
    EXPECT_LE(far.max_depth_m, far.lowest_tolerance);
}

TEST(FarBodies, AreAcceptedTo2e9MetresAndNoFarther) {
    World world = test::make_world();
    for (const int axis : {0, 1, 2}) {
        Eigen::Vector3d place(0.0, 0.0, 0.0);
        place[axis] = -2e9;
        EXPECT_TRUE(world.add({}, test::at(place)));
        place[axis] = std::nextafter(2e9, 3e9);
        const auto beyond = world.add({}, test::at(place));
        ASSERT_FALSE(beyond);
        EXPECT_NE(beyond.error().message.find("2e+09"), std::string::npos)
            << beyond.error().message;
    }
}

}  // namespace far_bodies_test
}  // namespace terrane
