// SPDX-License-Identifier: MIT
#include "track/camera_path.h"

#include "support/wave_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace terrane::tools {
namespace {

// 16 km square, hills of 300 m every 2 km.
const test::WaveHeights& hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

CameraPath make(const std::string& name, double speed, double altitude, double seconds) {
    Result<CameraPath> path = CameraPath::create(
        name, hills(), {.speed = speed, .altitude = altitude, .seconds = seconds});
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

Track make_track(const std::vector<std::array<double, 4>>& points, bool has_heights) {
    Track track;
    track.has_times = true;
    track.has_heights = has_heights;
    for (const auto& [time, x, y, z] : points) {
        TrackPoint point;
        point.time = time;
        point.position_world = WorldPos(x, y, z);
        track.points.push_back(point);
    }
    return track;
}

constexpr std::array<const char*, 3> kBuiltIns{"straight", "orbit", "canyon"};

TEST(CameraPath, NeverGoesUnderGroundAndKeepsItsClearance) {
    for (const char* name : kBuiltIns) {
        for (const double speed : {20.0, 90.0, 300.0}) {
            for (const double altitude : {10.0, 150.0}) {
                const CameraPath path = make(name, speed, altitude, 12.0);
                double lowest = 1e9;
                for (double time = 0.0; time <= path.duration(); time += 1.0 / 120.0) {
                    const WorldPos eye = path.at(time).eye_world;
                    lowest = std::min(lowest, eye.z() - hills().height(eye.x(), eye.y()));
                }
                EXPECT_GT(lowest, 0.45 * altitude) << name << " at " << speed << " m/s";
            }
        }
    }
}

TEST(CameraPath, HoldsItsSpeedOverThePlane) {
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 80.0, 100.0, 15.0);
        for (double time = 0.0; time <= path.duration(); time += 0.05) {
            EXPECT_NEAR(path.at(time).velocity.head<2>().norm(), 80.0, 4.0) << name << " " << time;
        }
    }
}

TEST(CameraPath, VelocityIsTheRateOfTheEye) {
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 120.0, 100.0, 10.0);
        constexpr double kStep = 1e-3;
        for (double time = 0.5; time < 9.5; time += 0.37) {
            const Eigen::Vector3d rate =
                (path.at(time + kStep).eye_world - path.at(time - kStep).eye_world) / (2.0 * kStep);
            EXPECT_LT((rate - path.at(time).velocity).norm(), 1e-2) << name << " " << time;
        }
    }
}

// A corner in the way would be an acceleration of speed * frames a second: thousands of m/s^2.
TEST(CameraPath, HasNoSpikesOfAccelerationNorOfTurning) {
    constexpr double kFrame = 1.0 / 60.0;
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 100.0, 100.0, 15.0);
        double most = 0.0, most_turn_change = 0.0;
        for (double time = kFrame; time + kFrame <= path.duration(); time += kFrame) {
            const CameraPose before = path.at(time - kFrame), now = path.at(time),
                             after = path.at(time + kFrame);
            most = std::max(most, (after.velocity - now.velocity).norm() / kFrame);
            const Eigen::Vector3d change = after.forward - 2.0 * now.forward + before.forward;
            const Eigen::Vector3d roll = after.up - 2.0 * now.up + before.up;
            most_turn_change =
                std::max({most_turn_change, change.norm() / kFrame, roll.norm() / kFrame});
        }
        EXPECT_LT(most, 60.0) << name << " m/s^2";
        EXPECT_LT(most_turn_change, 0.05) << name << " rad/s from frame to frame";
    }
}

TEST(CameraPath, PosesAreOrthonormal) {
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 100.0, 100.0, 10.0);
        for (double time = 0.0; time <= 10.0; time += 0.1) {
            View view;
            const CameraPose pose = path.at(time);
            view.eye_world = pose.eye_world;
            view.forward = pose.forward;
            view.up = pose.up;
            const Result<void> good = check(view);
            EXPECT_TRUE(good) << name << " " << time << ": " << good.error().message;
        }
    }
}

TEST(CameraPath, TheSameQuestionsGiveTheSameBits) {
    for (const char* name : kBuiltIns) {
        const CameraPath a = make(name, 70.0, 60.0, 8.0), b = make(name, 70.0, 60.0, 8.0);
        for (double time = 8.0; time >= 0.0; time -= 0.31) {
            const CameraPose p = a.at(time), q = b.at(time);
            EXPECT_EQ(p.eye_world, q.eye_world);
            EXPECT_EQ(p.forward, q.forward);
            EXPECT_EQ(p.up, q.up);
        }
    }
}

TEST(CameraPath, CanyonsStayOnLowerGroundThanStraightLines) {
    const auto mean_ground = [](const CameraPath& path) {
        double sum = 0.0;
        int count = 0;
        for (double time = 0.0; time <= path.duration(); time += 0.1, ++count) {
            const WorldPos eye = path.at(time).eye_world;
            sum += hills().height(eye.x(), eye.y());
        }
        return sum / count;
    };
    EXPECT_LT(mean_ground(make("canyon", 60.0, 50.0, 60.0)), -50.0);
}

TEST(CameraPath, OrbitsLookAtTheMiddle) {
    const CameraPath path = make("orbit", 100.0, 200.0, 20.0);
    const WorldPos middle(0.0, 0.0, hills().height(0.0, 0.0));
    for (double time = 0.0; time <= 20.0; time += 1.3) {
        const CameraPose pose = path.at(time);
        EXPECT_GT(pose.forward.dot((middle - pose.eye_world).normalized()), 1.0 - 1e-12);
    }
}

TEST(CameraPath, TracksAreFollowedThroughTheirPoints) {
    const Track track = make_track({{0.0, 0.0, 0.0, 500.0},
                                    {2.0, 100.0, 0.0, 520.0},
                                    {3.0, 150.0, 60.0, 510.0},
                                    {7.0, 150.0, 400.0, 530.0}},
                                   true);
    Result<CameraPath> path = CameraPath::create(track, hills(), {});
    ASSERT_TRUE(path) << path.error().message;
    EXPECT_EQ(path->duration(), 7.0);
    for (const TrackPoint& point : track.points) {
        EXPECT_LT((path->at(point.time).eye_world - point.position_world).norm(), 1e-9);
    }
    for (double time = 0.01; time < 7.0; time += 0.01) {
        const Eigen::Vector3d change = path->at(time).velocity - path->at(time - 0.01).velocity;
        EXPECT_LT(change.norm(), 5.0) << time;
    }
}

TEST(CameraPath, TracksWithoutTimesOrHeightsTakeSpeedAndAltitude) {
    Track track =
        make_track({{0, 0, 0, 0}, {0, 300, 0, 0}, {0, 300, 0, 0}, {0, 300, 400, 0}}, false);
    track.has_times = false;
    Result<CameraPath> path = CameraPath::create(track, hills(), {.speed = 50.0, .altitude = 80.0});
    ASSERT_TRUE(path) << path.error().message;
    EXPECT_DOUBLE_EQ(path->duration(), 14.0);
    const WorldPos eye = path->at(6.0).eye_world;
    EXPECT_LT((eye.head<2>() - Eigen::Vector2d(300.0, 0.0)).norm(), 1e-9);
    EXPECT_GT(eye.z(), hills().height(eye.x(), eye.y()) + 36.0);
}

TEST(CameraPath, RecordedTracksAreLiftedOutOfTheGround) {
    std::vector<std::array<double, 4>> points;
    for (int i = 0; i < 120; ++i) points.push_back({1.0 * i, 20.0 * i, 500.0, -400.0});
    Track track = make_track(points, true);
    track.is_recorded = true;
    Result<CameraPath> path = CameraPath::create(track, hills(), {});
    ASSERT_TRUE(path) << path.error().message;
    for (double time = 0.0; time <= path->duration(); time += 0.05) {
        const WorldPos eye = path->at(time).eye_world;
        EXPECT_GT(eye.z() - hills().height(eye.x(), eye.y()), 1.0) << time;
    }
}

TEST(CameraPath, ACameraThatStandsKeepsItsLook) {
    const Track track = make_track(
        {{0, 0, 0, 900}, {5, 0, 0, 900}, {10, 0, 500, 900}, {15, 0, 500, 900}, {20, 0, 500, 900}},
        true);
    Result<CameraPath> path = CameraPath::create(track, hills(), {});
    ASSERT_TRUE(path) << path.error().message;
    for (const double time : {0.0, 2.0, 12.0, 20.0}) {
        EXPECT_GT(path->at(time).forward.y(), 0.9) << time;
    }
}

TEST(CameraPath, ImpossibleRequestsAreErrors) {
    EXPECT_FALSE(CameraPath::create("zigzag", hills(), {}));
    const Track track = make_track({{0, 0, 0, 0}, {5, 10, 0, 0}}, true);
    EXPECT_FALSE(CameraPath::create(track, hills(), {.start = 5.0}));
    Track still = make_track({{0, 1, 1, 0}, {0, 1, 1, 0}}, true);
    still.has_times = false;
    EXPECT_FALSE(CameraPath::create(still, hills(), {}));
}

}  // namespace
}  // namespace terrane::tools
