// SPDX-License-Identifier: MIT
#include "flight/cameras.h"

#include "flight/flight_options.h"
#include "support/grounds.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace terrane::tools {
namespace terrain_track_test {

TEST(TerrainTrack, SaysWhyATerrainHasNoLongitudes) {
    Terrain terrain;
    EXPECT_EQ(track_reference(terrain).why_not, "this terrain has no raster");
    terrain.dem = DemInfo();
    EXPECT_EQ(track_reference(terrain).why_not, "the raster has no CRS");
    EXPECT_FALSE(track_reference(terrain).world_from_lonlat);
}

TEST(TerrainTrack, RefusesAStartBeyondItsEndByTheNameOfTheFlag) {
    Track track;
    track.has_times = true;
    track.points.resize(2);
    track.points[1].time = 5.0;
    track.points[1].position_world = WorldPos(10.0, 0.0, 0.0);
    const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    const auto path = follow_track(track, source, {.start = 7.0});
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().message, "--start-s must be before the track's end at 5 s, got 7 s");
}

}  // namespace terrain_track_test

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

namespace drop_camera_test {

const std::shared_ptr<const HeightSource> kHills = FractalHeights::create({.seed = 9}).value();

BodyState body_at(double x, double y) {
    BodyState state;
    state.pose.translation = {x, y, kHills->height(x, y) + 1.0};
    return state;
}

View make_picture() {
    View view;
    view.width_px = 160;
    view.height_px = 90;
    view.vertical_fov = 1.0;
    return view;
}

TEST(DropCamera, LooksAtTheMiddleFromAboveTheGroundAndFollows) {
    std::vector<BodyState> bodies{body_at(100.0, 100.0), body_at(160.0, 100.0),
                                  body_at(130.0, 150.0)};
    DropCamera camera(kHills, bodies);
    for (int frame = 0; frame < 600; ++frame) {
        for (BodyState& body : bodies) {
            const WorldPos& p = body.pose.translation;
            body = body_at(p.x() + 0.5, p.y() - 0.2);
        }
        camera.follow(bodies, 1.0 / 30.0);
        const View view = camera.view(make_picture());
        ASSERT_TRUE(view.validate()) << frame;
        ASSERT_GT(view.eye_world.z(), kHills->height(view.eye_world.x(), view.eye_world.y()));
        EXPECT_LT(camera.velocity().norm(), 60.0) << frame;
        WorldPos middle = WorldPos::Zero();
        for (const BodyState& body : bodies) middle += body.pose.translation / 3.0;
        const Eigen::Vector3d to = (middle - view.eye_world).normalized();
        EXPECT_GT(to.dot(view.forward), 0.9) << frame;
    }
}

TEST(DropCamera, SeesOneBodyFromAFewMetres) {
    const std::vector<BodyState> bodies{body_at(40.0, -70.0)};
    const DropCamera camera(kHills, bodies);
    const double distance =
        (camera.view(make_picture()).eye_world - bodies[0].pose.translation).norm();
    EXPECT_GT(distance, 2.0);
    EXPECT_LT(distance, 20.0);
}

// Bodies outside the extent are not followed, unless all are.
TEST(DropCamera, StaysWithThoseThatAreOnTheTerrain) {
    std::vector<BodyState> bodies{body_at(0.0, 0.0), body_at(10.0, 0.0)};
    DropCamera camera(kHills, bodies);
    const WorldPos before = camera.view(make_picture()).eye_world;
    bodies[1].condition = BodyCondition::left_world;
    bodies[1].pose.translation = {1e6, 0.0, -1e6};
    camera.follow(bodies, 1.0 / 30.0);
    EXPECT_LT((camera.view(make_picture()).eye_world - before).norm(), 5.0);
    bodies[0] = bodies[1];
    camera.follow(bodies, 1.0 / 30.0);
    EXPECT_TRUE(camera.view(make_picture()).validate());
}

}  // namespace drop_camera_test
}  // namespace terrane::tools
