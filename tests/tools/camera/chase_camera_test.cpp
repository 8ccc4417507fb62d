// SPDX-License-Identifier: MIT
#include "flight/cameras.h"
#include "support/heights/table_ground.h"
#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

#include <memory>

namespace terrane::tools {
namespace chase_camera_test {

constexpr double kFloor = -20.0, kCeiling = -14.0, kWall = 50.0;

/// Flat ground at 0 over one chunk of 128 m, and a hall below it: floor, ceiling, and a wall at its western end.
std::shared_ptr<const SolidSurface> make_hall(const Chunk&) {
    SolidTriangles hall;
    const auto add_quad = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
        const auto first = static_cast<std::uint32_t>(hall.vertices_world.size());
        hall.vertices_world.insert(hall.vertices_world.end(), {a, b, c, d});
        hall.triangles.push_back({first, first + 1, first + 2});
        hall.triangles.push_back({first, first + 2, first + 3});
    };
    add_quad({kWall, 0, kFloor}, {128, 0, kFloor}, {128, 128, kFloor}, {kWall, 128, kFloor});
    add_quad({kWall, 128, kCeiling}, {128, 128, kCeiling}, {128, 0, kCeiling},
             {kWall, 0, kCeiling});
    add_quad({kWall, 0, kFloor}, {kWall, 128, kFloor}, {kWall, 128, kCeiling},
             {kWall, 0, kCeiling});
    hall.parts.assign(hall.triangles.size(), SolidPart::cavity);
    return std::make_shared<const SolidSurface>(std::move(hall));
}

const auto kFlat = [](double, double) { return 0.0; };

WorldPos eye_after(const WorldPos& start, const Eigen::Vector3d& velocity, const Ground& ground) {
    const test::WaveHeights flat(ground.lattice(), 0.0, 100.0);
    Pose pose;
    pose.translation = start;
    ChaseCamera camera(flat, pose);
    constexpr double kStep = 0.05;
    for (int i = 0; i < 60; ++i) {
        pose.translation += kStep * velocity;
        camera.follow(pose, kStep, ground);
    }
    return camera.view(View{}).eye_world;
}

TEST(ChaseCamera, StaysBetweenFloorAndCeilingInFrontOfAWall) {
    const Ground ground = test::make_test_ground(kFlat, {.solid = make_hall});
    const WorldPos eye = eye_after({60.0, 64.0, kFloor + 1.0}, Eigen::Vector3d::Zero(), ground);
    EXPECT_GT(eye.x(), kWall);
    EXPECT_LT(eye.x(), 60.0);
    EXPECT_GT(eye.z(), kFloor);
    EXPECT_LT(eye.z(), kCeiling);
}

TEST(ChaseCamera, FollowsThroughAHallAsOverOpenGround) {
    const Ground hall = test::make_test_ground(kFlat, {.solid = make_hall});
    const Ground open = test::make_test_ground(kFlat, {});
    const Eigen::Vector3d velocity(8.0, 0.0, 0.0);
    const WorldPos in_hall = eye_after({70.0, 64.0, kFloor + 1.0}, velocity, hall);
    const WorldPos outside = eye_after({70.0, 64.0, 1.0}, velocity, open);
    EXPECT_NEAR(in_hall.x(), outside.x(), 1e-9);
    EXPECT_NEAR(in_hall.z() - kFloor, outside.z(), 0.1);
}

TEST(ChaseCamera, StaysAboveTheGroundOverAHall) {
    const Ground ground = test::make_test_ground(kFlat, {.solid = make_hall});
    const WorldPos eye = eye_after({60.0, 64.0, 1.0}, {8.0, 0.0, 0.0}, ground);
    EXPECT_GT(eye.z(), 0.5);
}

}  // namespace chase_camera_test
}  // namespace terrane::tools
