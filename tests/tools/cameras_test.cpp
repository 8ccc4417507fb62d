// SPDX-License-Identifier: MIT
#include "flight/cameras.h"

#include "flight/flight_options.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
    const World world = World::create({}).value();
    Pose pose;
    pose.translation = start;
    ChaseCamera camera(flat, pose);
    constexpr double kStep = 0.05;
    for (int i = 0; i < 60; ++i) {
        pose.translation += kStep * velocity;
        camera.follow(pose, kStep, ground, world);
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

/// What a camera that follows a vehicle did.
struct Followed {
    int frames = 0, hidden = 0, in_body = 0;
    double least_height = 1e9;  // of the eye above the ground, metres
    double most_speed = 0.0;    // of the eye relative to the vehicle, m/s
    double most_acceleration = 0.0, mean_distance = 0.0;
};

constexpr double kFrame = 1.0 / 60.0;

/// Follows a pose, a function of the frame, for a number of frames; counts those in which bodies of `solid` or the
/// ground hide the middle of the vehicle.
template <class PoseAt>
Followed follow(const PoseAt& pose_at, int frames, const HeightSource& source, const Ground& ground,
                const World& avoided, const World& solid) {
    ChaseCamera camera(source, pose_at(0));
    Followed result;
    WorldPos before = WorldPos::Zero();
    Eigen::Vector3d velocity_before = Eigen::Vector3d::Zero();
    for (int i = 1; i <= frames; ++i) {
        const Pose pose = pose_at(i);
        camera.follow(pose, kFrame, ground, avoided);
        const WorldPos eye = camera.view(View{}).eye_world;
        const WorldPos middle = pose.translation + Eigen::Vector3d(0.0, 0.0, 0.8);
        ++result.frames;
        result.hidden += solid.ray(ground, middle, eye).hit ? 1 : 0;
        std::array<BodyId, 1> inside;
        const QueryFilter bodies{.include_ground = false};
        result.in_body +=
            solid.overlaps(ground, Sphere{0.1}, {Eigen::Matrix3d::Identity(), eye}, inside, bodies)
                        .touching_count > 0
                ? 1
                : 0;
        result.least_height =
            std::min(result.least_height, eye.z() - source.height(eye.x(), eye.y()));
        result.mean_distance += (eye - middle).norm() / frames;
        const WorldPos relative = eye - pose.translation;
        const Eigen::Vector3d velocity = (relative - before) / kFrame;
        if (i > 2) result.most_speed = std::max(result.most_speed, velocity.norm());
        if (i > 3) {
            result.most_acceleration =
                std::max(result.most_acceleration, (velocity - velocity_before).norm() / kFrame);
        }
        velocity_before = velocity;
        before = relative;
    }
    return result;
}

/// A pose at a place of a curve, looking along it, 0.75 m above the source.
Pose pose_on(const HeightSource& source, const Eigen::Vector2d& place,
             const Eigen::Vector2d& along) {
    const Eigen::Vector2d ahead = along.normalized();
    Pose pose;
    pose.rotation << ahead.x(), -ahead.y(), 0.0, ahead.y(), ahead.x(), 0.0, 0.0, 0.0, 1.0;
    pose.translation = {place.x(), place.y(), source.height(place.x(), place.y()) + 0.75};
    return pose;
}

void add_static(World& world, const Shape& shape, const WorldPos& place) {
    BodyPlacement placement;
    placement.pose.translation = place;
    ASSERT_TRUE(world.add({.shape = shape, .type = BodyType::static_body}, placement));
}

TEST(ChaseCamera, ComesInFrontOfAWallAndReturns) {
    const Ground ground = test::make_test_ground(kFlat, {});
    const test::WaveHeights flat(ground.lattice(), 0.0, 100.0);
    World world = World::create({}).value();
    // The wall stops the eye; the vehicle passes through its gate.
    add_static(world, Box{{0.2, 20.0, 5.0}}, {40.0, 64.0 + 21.2, 5.0});
    add_static(world, Box{{0.2, 20.0, 5.0}}, {40.0, 64.0 - 21.2, 5.0});
    add_static(world, Box{{0.2, 1.2, 1.2}}, {40.0, 64.0, 3.8});
    const auto pose_at = [&](int frame) {
        return pose_on(flat, {25.0 + 6.0 * kFrame * frame, 64.0}, {1.0, 0.0});
    };
    const World empty = World::create({}).value();
    const Followed unaware = follow(pose_at, 600, flat, ground, empty, world);
    EXPECT_GT(unaware.hidden, 60);
    const Followed aware = follow(pose_at, 600, flat, ground, world, world);
    EXPECT_LT(aware.hidden, 12);
    EXPECT_LE(aware.in_body, 6);
    // from rest to rest over 8.7 m with 50 m/s^2
    EXPECT_LT(aware.most_speed, 21.0);
    EXPECT_LT(aware.most_acceleration, 70.0);
    // at rest behind the open, it is where it is without a wall
    ChaseCamera camera(flat, pose_at(600)), free(flat, pose_at(600));
    for (int i = 0; i < 60; ++i) {
        camera.follow(pose_at(600), kFrame, ground, world);
        free.follow(pose_at(600), kFrame, ground, empty);
    }
    EXPECT_EQ(camera.view(View{}).eye_world, free.view(View{}).eye_world);
}

TEST(ChaseCamera, SeesItsTargetThroughAForest) {
    const Ground ground = test::make_test_ground(kFlat, {.spacing = 4.0});
    const test::WaveHeights flat(ground.lattice(), 0.0, 100.0);
    World forest = World::create({}).value();
    const auto place_at = [](double along) {
        return Eigen::Vector2d(40.0 + along, 250.0 + 12.0 * std::sin(along / 18.0));
    };
    test::Random random(3);
    // crowns that reach over the track at the height of the eye, with room for the vehicle below them
    for (int i = 0; i < 1000; ++i) {
        const Eigen::Vector2d place(random.between(20.0, 490.0), random.between(225.0, 275.0));
        double nearest = 1e9;
        for (double along = -20.0; along < 450.0; along += 0.5)
            nearest = std::min(nearest, (place_at(along) - place).norm());
        if (nearest < 1.5) continue;
        add_static(forest, Capsule{0.25, 4.0}, {place.x(), place.y(), 4.0});
        add_static(forest, Sphere{2.4}, {place.x(), place.y(), 4.5});
    }
    const auto pose_at = [&](int frame) {
        const double along = 8.0 * kFrame * frame;
        return pose_on(flat, place_at(along), place_at(along + 0.1) - place_at(along));
    };
    const World empty = World::create({}).value();
    const Followed unaware = follow(pose_at, 2900, flat, ground, empty, forest);
    const Followed aware = follow(pose_at, 2900, flat, ground, forest, forest);
    RecordProperty("hidden_unaware", unaware.hidden);
    RecordProperty("hidden_aware", aware.hidden);
    EXPECT_GT(unaware.hidden, 290);
    EXPECT_LT(aware.hidden, 30);
    EXPECT_LT(aware.in_body, 15);
    EXPECT_GT(aware.least_height, 0.5);
    EXPECT_LT(aware.most_speed, 25.0);
    EXPECT_LT(aware.most_acceleration, 70.0);
    EXPECT_GT(aware.mean_distance, 6.0);
}

TEST(ChaseCamera, LooksOverCrests) {
    const Ground chunk = test::make_test_ground(kFlat, {.spacing = 4.0});
    const test::WaveHeights hills(chunk.lattice(), 4.0, 60.0);
    const Ground ground = test::make_test_ground(
        [&](double x, double y) { return hills.height(x, y); }, {.spacing = 0.5, .roots = 8});
    const auto pose_at = [&](int frame) {
        return pose_on(hills, {40.0 + 8.0 * kFrame * frame, 60.0 + 4.0 * kFrame * frame},
                       {2.0, 1.0});
    };
    const World empty = World::create({}).value();
    const Followed seen = follow(pose_at, 2700, hills, ground, empty, empty);
    EXPECT_EQ(seen.hidden, 0);
    EXPECT_GT(seen.least_height, 0.5);
    EXPECT_LT(seen.most_speed, 15.0);
    EXPECT_LT(seen.most_acceleration, 80.0);
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
            body.velocity = {15.0, -6.0, 0.0};
        }
        camera.follow(bodies, 1.0 / 30.0);
        const View view = camera.view(make_picture());
        ASSERT_TRUE(view.validate()) << frame;
        ASSERT_GT(view.eye_world.z(), kHills->height(view.eye_world.x(), view.eye_world.y()));
        EXPECT_LT(camera.velocity().norm(), 60.0) << frame;
        WorldPos middle = WorldPos::Zero();
        for (const BodyState& body : bodies) middle += body.pose.translation / 3.0;
        const Eigen::Vector3d to = (middle - view.eye_world).normalized();
        EXPECT_GT(to.dot(view.forward), frame < 60 ? 0.9 : 0.99) << frame;
    }
}

// A ball that rolls faster and faster stays in the middle of the picture.
TEST(DropCamera, KeepsOneFastBodyInThePicture) {
    std::vector<BodyState> bodies{body_at(-400.0, 0.0)};
    DropCamera camera(kHills, bodies);
    constexpr double kStep = 1.0 / 30.0;
    double speed = 0.0;
    for (int frame = 0; frame < 300; ++frame) {
        speed += 3.0 * kStep;
        bodies[0] = body_at(bodies[0].pose.translation.x() + speed * kStep, 0.0);
        bodies[0].velocity.x() = speed;
        camera.follow(bodies, kStep);
        const View view = camera.view(make_picture());
        const Eigen::Vector3d to = bodies[0].pose.translation - view.eye_world;
        EXPECT_GT(to.normalized().dot(view.forward), 0.94) << frame;
        EXPECT_LT(to.norm(), 30.0) << frame;
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
