// SPDX-License-Identifier: MIT
#include "support/grounds.h"

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/view.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace camera_path_test {

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

constexpr std::array<const char*, 6> kBuiltIns{"straight", "orbit", "canyon",
                                               "turns",    "spins", "teleports"};

bool has_jump(const CameraPath& path, double from, double to) {
    return std::ranges::any_of(path.jumps(),
                               [=](double jump) { return jump >= from && jump <= to; });
}

/// Signed angle from one direction to another, seen from above, radians.
double turn(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return std::atan2(from.x() * to.y() - from.y() * to.x(), from.head<2>().dot(to.head<2>()));
}

/// Keeps what was expected, and whether the chunk of each height came first in the last call.
class ExpectingHeights final : public ForwardedHeights {
public:
    explicit ExpectingHeights(std::shared_ptr<const HeightSource> heights)
        : ForwardedHeights(std::move(heights)) {}

    void expect_chunks(std::span<const ChunkKey> keys) const override {
        most = std::max(most, keys.size());
        all.insert(keys.begin(), keys.end());
        next = keys.front();
    }
    double height(double x, double y) const override {
        if (next) {
            const LatticePoint corner = lattice().corner(*next);
            const double side = kChunkCells * lattice().spacing;
            const double west = lattice().x(corner.x), south = lattice().y(corner.y);
            ++height_count;
            under_count += x >= west && y >= south && x <= west + side && y <= south + side;
        }
        return ForwardedHeights::height(x, y);
    }

    mutable std::set<ChunkKey> all;
    mutable std::optional<ChunkKey> next;
    mutable std::size_t most = 0;
    mutable int height_count = 0, under_count = 0;
};

TEST(CameraPath, SaysWhichChunksItReadsNext) {
    const ExpectingHeights source(
        std::make_shared<test::WaveHeights>(test::small_world(6, 1.0), 300.0, 2000.0));
    const WorldVec2 start(2000.0, 3000.0);
    ASSERT_TRUE(CameraPath::create("straight", source,
                                   {.speed = 100.0, .seconds = 20.0, .start_world = start}));
    EXPECT_GT(source.height_count, 1000);
    EXPECT_EQ(source.under_count, source.height_count);
    EXPECT_GE(source.all.size(), 16u) << "2 km, and a margin, over chunks of 128 m";
    EXPECT_GT(source.most, 8u);
    EXPECT_LE(source.most, 16u);
    for (const ChunkKey& key : source.all) EXPECT_TRUE(source.lattice().contains(key));
}

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

TEST(CameraPath, BeginsAtItsStartAndStaysInItsRegion) {
    // far from the middle, across the eastern border of the terrain
    const WorldVec2 start(15'000.0, 15'500.0);
    const WorldRect region{14'000.0, 14'000.0, 22'000.0, 20'000.0};
    for (const std::string name : kBuiltIns) {
        const CameraPathSettings settings{.speed = 80.0,
                                          .altitude = 100.0,
                                          .seconds = 20.0,
                                          .region = region,
                                          .start_world = start};
        const Result<CameraPath> path = CameraPath::create(name, hills(), settings);
        ASSERT_TRUE(path) << path.error().message;
        if (name != "canyon" && name != "teleports") {
            EXPECT_LT((path->at(0.0).eye_world.head<2>() - start).norm(), 1.0) << name;
        }
        for (double time = 0.0; time <= path->duration(); time += 0.1) {
            const WorldPos eye = path->at(time).eye_world;
            EXPECT_TRUE(region.contains(eye.x(), eye.y())) << name << " " << time;
        }
    }
}

TEST(CameraPath, HoldsItsSpeedOverThePlaneWithOrthonormalPosesOfTheSameBits) {
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 80.0, 100.0, 15.0),
                         again = make(name, 80.0, 100.0, 15.0);
        for (double time = 0.0; time <= path.duration(); time += 0.05) {
            SCOPED_TRACE(testing::Message() << name << " " << time);
            const CameraPose pose = path.at(time), same = again.at(time);
            EXPECT_NEAR(pose.velocity.head<2>().norm(), 80.0, 4.0);
            View view;
            view.eye_world = pose.eye_world;
            view.forward = pose.forward;
            view.up = pose.up;
            EXPECT_TRUE(view.validate());
            EXPECT_EQ(pose.eye_world, same.eye_world);
            EXPECT_EQ(pose.forward, same.forward);
            EXPECT_EQ(pose.up, same.up);
        }
    }
}

TEST(CameraPath, VelocityIsTheRateOfTheEye) {
    for (const char* name : kBuiltIns) {
        const CameraPath path = make(name, 120.0, 100.0, 10.0);
        constexpr double kStep = 1e-3;
        for (double time = 0.5; time < 9.5; time += 0.37) {
            if (has_jump(path, time - kStep, time + kStep)) continue;
            const Eigen::Vector3d rate =
                (path.at(time + kStep).eye_world - path.at(time - kStep).eye_world) / (2.0 * kStep);
            EXPECT_LT((rate - path.at(time).velocity).norm(), 1e-2) << name << " " << time;
        }
    }
}

// A corner in the path would be an acceleration of speed * frame rate: thousands of m/s^2.
TEST(CameraPath, HasNoSpikesOfAccelerationNorOfTurning) {
    constexpr double kFrame = 1.0 / 60.0;
    for (const std::string name : kBuiltIns) {
        const CameraPath path = make(name, 100.0, 100.0, 15.0);
        double most = 0.0, most_turn_change = 0.0;
        for (double time = kFrame; time + kFrame <= path.duration(); time += kFrame) {
            if (has_jump(path, time - kFrame, time + kFrame)) continue;
            const CameraPose before = path.at(time - kFrame), now = path.at(time),
                             after = path.at(time + kFrame);
            most = std::max(most, (after.velocity - now.velocity).norm() / kFrame);
            const Eigen::Vector3d change = after.forward - 2.0 * now.forward + before.forward;
            const Eigen::Vector3d roll = after.up - 2.0 * now.up + before.up;
            most_turn_change =
                std::max({most_turn_change, change.norm() / kFrame, roll.norm() / kFrame});
        }
        // a half circle in 6 s, with a maximum rate of 1.875 times the mean
        EXPECT_LT(most, name == "turns" ? 1.875 * 52.4 + 5.0 : 60.0) << name << " m/s^2";
        EXPECT_LT(most_turn_change, 0.05) << name << " rad/s from frame to frame";
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

// Lower hills, between which a path of 720 m fits.
const test::WaveHeights& low_hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 150.0, 2000.0);
    return source;
}

/// The steepest of the low hills under a path, rise over run.
double steepest_under(const CameraPath& path) {
    constexpr double kReach = 1.0;
    double most = 0.0;
    for (double time = 0.0; time <= path.duration(); time += 0.1) {
        const WorldPos p = path.at(time).eye_world;
        const auto height = [&](double x, double y) {
            return low_hills().height(p.x() + x, p.y() + y);
        };
        const double x = (height(kReach, 0.0) - height(-kReach, 0.0)) / (2.0 * kReach);
        const double y = (height(0.0, kReach) - height(0.0, -kReach)) / (2.0 * kReach);
        most = std::max(most, std::hypot(x, y));
    }
    return most;
}

TEST(CameraPath, PathsForVehiclesAvoidSteepGround) {
    double steepest = 0.0;
    for (const std::string name : {"straight", "orbit", "turns"}) {
        CameraPathSettings settings{
            .speed = 12.0, .seconds = 60.0, .region = WorldRect{6000.0, 6000.0, 9000.0, 9000.0}};
        const CameraPath any = CameraPath::create(name, low_hills(), settings).value();
        steepest = std::max(steepest, steepest_under(any));
        settings.max_slope = 0.4;
        const CameraPath path = CameraPath::create(name, low_hills(), settings).value();
        EXPECT_LT(steepest_under(path), 0.4) << name;
        double length = 0.0;
        for (double time = 0.1; time <= path.duration(); time += 0.1) {
            length += (path.at(time).eye_world - path.at(time - 0.1).eye_world).head<2>().norm();
        }
        EXPECT_NEAR(length, 720.0, 15.0) << name;
        const double away = (path.at(0.0).eye_world - any.at(0.0).eye_world).head<2>().norm();
        EXPECT_LT(away, 3000.0) << name;
    }
    EXPECT_GT(steepest, 0.42) << "or it says nothing";
}

TEST(CameraPath, PathsForVehiclesBeginNearTheirStart) {
    for (const std::string name : {"straight", "orbit", "turns"}) {
        const WorldVec2 start(7700.0, 7700.0);
        const CameraPath path =
            CameraPath::create(
                name, hills(),
                {.speed = 12.0, .seconds = 60.0, .start_world = start, .max_slope = 0.4})
                .value();
        EXPECT_LT((path.at(0.0).eye_world.head<2>() - start).norm(), 130.0) << name;
    }
}

TEST(CameraPath, PathsForVehiclesAreUnchangedOnGroundThatCanBeClimbed) {
    for (const std::string name : kBuiltIns) {
        CameraPathSettings settings{.speed = 12.0, .seconds = 20.0};
        const CameraPath any = CameraPath::create(name, hills(), settings).value();
        settings.max_slope = 2.0;
        const CameraPath path = CameraPath::create(name, hills(), settings).value();
        for (double time = 0.0; time <= path.duration(); time += 0.5) {
            ASSERT_EQ(path.at(time).eye_world, any.at(time).eye_world) << name << " " << time;
        }
    }
}

TEST(CameraPath, OrbitsLookAtTheMiddle) {
    const CameraPath path = make("orbit", 100.0, 200.0, 20.0);
    const WorldPos middle(0.0, 0.0, hills().height(0.0, 0.0));
    for (double time = 0.0; time <= 20.0; time += 1.3) {
        const CameraPose pose = path.at(time);
        EXPECT_GT(pose.forward.dot((middle - pose.eye_world).normalized()), 1.0 - 1e-12);
    }
}

TEST(CameraPath, TurnsGoThereAndBackOverTheMiddle) {
    const CameraPath path = make("turns", 100.0, 200.0, 60.0);
    // 5 s straight, a half circle to the left in 6 s
    for (int period = 0; period < 5; ++period) {
        const double start = 11.0 * period;
        const Eigen::Vector3d heading = path.at(start + 0.5).velocity;
        EXPECT_NEAR(turn(heading, path.at(start + 4.5).velocity), 0.0, 1e-6);
        EXPECT_NEAR(turn(heading, path.at(start + 8.0).velocity), 0.5 * M_PI, 0.05);
        EXPECT_NEAR(std::abs(turn(heading, path.at(start + 11.5).velocity)), M_PI, 1e-6);
    }
    EXPECT_LT(path.at(2.5).eye_world.head<2>().norm(), 1.0) << "the middle of the first straight";
    EXPECT_LT((path.at(24.5).eye_world - path.at(2.5).eye_world).head<2>().norm(), 10.0)
        << "after two turns it is there again";
    double most = 0.0;
    for (double time = 0.1; time < 60.0; time += 0.1) {
        most = std::max(most, turn(path.at(time - 0.1).velocity, path.at(time).velocity) / 0.1);
        EXPECT_GT(turn(path.at(time - 0.1).velocity, path.at(time).velocity), -1e-3) << time;
    }
    EXPECT_NEAR(most, 1.875 * M_PI / 6.0, 0.02);
}

TEST(CameraPath, TurnsFitSmallTerrains) {
    const CameraPath path = make("turns", 1000.0, 500.0, 40.0);
    for (double time = 0.0; time <= 40.0; time += 0.25) {
        const WorldPos eye = path.at(time).eye_world;
        EXPECT_LT(std::abs(eye.x()), 8000.0) << time;
        EXPECT_LT(std::abs(eye.y()), 8000.0) << time;
    }
}

TEST(CameraPath, SpinsTurnTheViewAndNotThePath) {
    const CameraPath path = make("spins", 30.0, 200.0, 26.0);
    constexpr double kStep = 0.05;
    int left = 0, right = 0, resting = 0;
    double sum = 0.0;
    for (double time = kStep; time <= 26.0; time += kStep) {
        EXPECT_NEAR(turn(Eigen::Vector3d::UnitX(), path.at(time).velocity), 0.0, 1e-9);
        const double rate = turn(path.at(time - kStep).forward, path.at(time).forward) / kStep;
        EXPECT_LT(std::abs(rate), 0.5 * M_PI + 0.01) << time;
        left += rate > 0.5 * M_PI - 0.01 ? 1 : 0;
        right += rate < -0.5 * M_PI + 0.01 ? 1 : 0;
        resting += std::abs(rate) < 0.01 ? 1 : 0;
        sum += rate * kStep;
    }
    // of 26 s: two whole turns and two half ones to the left, two half ones to the right
    EXPECT_NEAR(left * kStep, 2.0 * (3.25 + 1.25), 0.5);
    EXPECT_NEAR(right * kStep, 2.0 * 1.25, 0.4);
    EXPECT_NEAR(resting * kStep, 2.0 * 2.75, 0.5);
    EXPECT_NEAR(sum, 4.0 * M_PI, 0.05);
    EXPECT_GT(path.at(0.5).forward.x(), 0.9);
    EXPECT_LT(path.at(1.0 + 0.375 + 2.0).forward.x(), -0.9) << "half a turn after the ramp";
}

TEST(CameraPath, TeleportsAreSeenInTheInterface) {
    const CameraPath path = make("teleports", 50.0, 200.0, 22.0);
    ASSERT_EQ(path.jumps().size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        const double jump = path.jumps()[i];
        EXPECT_EQ(jump, 5.0 * static_cast<double>(i + 1));
        const CameraPose before = path.before(jump), after = path.at(jump);
        EXPECT_GT((after.eye_world - before.eye_world).head<2>().norm(), 3000.0) << jump;
        EXPECT_NEAR(std::abs(turn(before.velocity, after.velocity)), 1.855, 0.01) << jump;
        EXPECT_LT((path.at(jump - 1e-6).eye_world - before.eye_world).norm(), 1e-3) << jump;
        EXPECT_LT((path.at(jump + 1e-6).eye_world - after.eye_world).norm(), 1e-3) << jump;
    }
    EXPECT_EQ(path.before(7.0).eye_world, path.at(7.0).eye_world);
    EXPECT_TRUE(make("straight", 50.0, 200.0, 22.0).jumps().empty());
}

TEST(CameraPath, TeleportsStayInsideTheTerrainAndDoNotComeBack) {
    const CameraPath path = make("teleports", 100.0, 200.0, 100.0);
    std::vector<Eigen::Vector2d> places;
    for (double time = 2.5; time < 100.0; time += 5.0) {
        const Eigen::Vector2d p = path.at(time).eye_world.head<2>();
        EXPECT_LT(p.cwiseAbs().maxCoeff(), 8000.0) << time;
        for (const Eigen::Vector2d& other : places) EXPECT_GT((p - other).norm(), 500.0) << time;
        places.push_back(p);
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

TEST(CameraPath, AStandingCameraKeepsItsViewDirection) {
    const Track track = make_track(
        {{0, 0, 0, 900}, {5, 0, 0, 900}, {10, 0, 500, 900}, {15, 0, 500, 900}, {20, 0, 500, 900}},
        true);
    Result<CameraPath> path = CameraPath::create(track, hills(), {});
    ASSERT_TRUE(path) << path.error().message;
    for (const double time : {0.0, 2.0, 12.0, 20.0}) {
        EXPECT_GT(path->at(time).forward.y(), 0.9) << time;
    }
}

}  // namespace camera_path_test

// Settings and tracks that no path can be made of are refused with a line that names them.

namespace path_refusals_test {

using camera_path_test::hills;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Track two_points(double last_time) {
    return camera_path_test::make_track({{0, 0, 0, 0}, {last_time, 100, 0, 50}}, true);
}

std::string refusal(const Result<CameraPath>& path) {
    return path ? std::string() : path.error().message;
}

TEST(CameraPathRefusals, NameTheSettingAndItsValue) {
    struct Fault {
        CameraPathSettings settings;
        std::string said;
    };
    for (const auto& [settings, said] : {
             Fault{{.speed = 0.0}, "speed must be above 0 and finite, got 0"},
             Fault{{.speed = kInfinity}, "speed must be above 0 and finite, got inf"},
             Fault{{.altitude = -3.0}, "altitude must be above 0 and finite, got -3"},
             Fault{{.altitude = kNaN}, "altitude must be above 0 and finite, got nan"},
             Fault{{.seconds = -1.0}, "seconds must be above 0 and finite, got -1"},
             Fault{{.seconds = 1e300}, "seconds must be 0 to 1e+07, got 1e+300"},
             Fault{{.region = WorldRect{0.0, 0.0, 10.0, 0.0}},
                   "region must have finite sides above 0, got 0 to 10 and 0 to 0"},
             Fault{{.region = WorldRect{-kInfinity, 0.0, 10.0, 1.0}}, "region"},
             Fault{{.region = WorldRect{0.0, 0.0, kNaN, 1.0}}, "region"},
             Fault{{.max_slope = 0.0}, "max_slope must be above 0 and finite, got 0"},
             Fault{{.max_bump = 0.0}, "max_bump must be above 0, got 0"},
             Fault{{.max_bump = kNaN}, "max_bump must be above 0, got nan"},
             Fault{{.bump_reach = 0.0}, "bump_reach must be above 0 and finite, got 0"},
             Fault{{.start_world = WorldVec2(1.0, kNaN)}, "start_world must be finite, got 1, nan"},
             Fault{{.start = -1.0}, "start must be 0 to"},
             Fault{{.start = kNaN}, "start must be 0 to"},
         }) {
        const std::string built_in = refusal(CameraPath::create("straight", hills(), settings));
        EXPECT_TRUE(built_in.starts_with(said)) << built_in;
        EXPECT_EQ(refusal(CameraPath::create(two_points(5.0), hills(), settings)), built_in);
    }
    EXPECT_TRUE(CameraPath::create("straight", hills(), {}));
    EXPECT_FALSE(CameraPath::create("zigzag", hills(), {}));
}

TEST(CameraPathRefusals, NameThePointOfATrack) {
    const auto with = [](const auto& change) {
        Track track = two_points(5.0);
        change(track);
        return track;
    };
    struct Fault {
        Track track;
        std::string said;
    };
    for (const auto& [track, said] : {
             Fault{{}, "a track needs two points or more, got 0"},
             Fault{two_points(0.0), "point 1 of a track must be later than the one before"},
             Fault{two_points(kNaN), "point 1 of a track must be later than the one before"},
             Fault{with([](Track& late) { late.points[0].time = 1.0; }),
                   "point 0 of a track must have the time 0, got 1 s"},
             Fault{with([](Track& nowhere) { nowhere.points[1].position_world.y() = kNaN; }),
                   "point 1 of a track must have a finite position"},
             Fault{with([](Track& blind) {
                       blind.has_orientations = true;
                       blind.points[0].forward.x() = kInfinity;
                   }),
                   "point 0 of a track must have finite directions"},
         }) {
        const Result<void> good = track.validate();
        ASSERT_FALSE(good) << said;
        EXPECT_TRUE(good.error().message.starts_with(said)) << good.error().message;
        EXPECT_EQ(refusal(CameraPath::create(track, hills(), {})), good.error().message);
    }
    EXPECT_TRUE(CameraPath::create(two_points(5.0), hills(), {}));
    EXPECT_EQ(refusal(CameraPath::create(two_points(1e300), hills(), {})),
              "a path lasts 1e+07 s at most, this track lasts 1e+300 s");
    EXPECT_EQ(refusal(CameraPath::create(two_points(5.0), hills(), {.start = 5.0})),
              "start must be before the track's end at 5 s, got 5 s");
    // a track without times that stays in its place
    EXPECT_FALSE(CameraPath::create(with([](Track& still) {
                                        still.points[1].position_world =
                                            still.points[0].position_world;
                                        still.has_times = false;
                                    }),
                                    hills(), {}));
}

}  // namespace path_refusals_test
}  // namespace terrane
