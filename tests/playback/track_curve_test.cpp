// SPDX-License-Identifier: MIT
// Curves through the points of tracks with uneven intervals, compared with the polyline through the points.
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/playback/camera_path.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace track_curve_test {

// Bounds that curve.h and camera_path.h state.
constexpr double kMostOfChord = 0.53;   // of the length of a chord
constexpr double kMostSeconds = 1.5;    // of motion
constexpr double kMostRecorded = 2.3;   // seconds of motion of a recorded track
constexpr double kReachRecorded = 6.0;  // seconds around a time in which that motion is

const test::WaveHeights& low_hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

Track track_of(const std::vector<double>& times, const std::vector<WorldPos>& places) {
    Track track;
    track.has_times = track.has_heights = true;
    for (std::size_t i = 0; i < times.size(); ++i) {
        track.points.push_back({});
        track.points.back().time = times[i];
        track.points.back().position_world = places[i];
    }
    return track;
}

struct Shape {
    std::string name;
    Track track;
};

/// Adds a point `wait` seconds after the last one.
void add(Track& track, double wait, const WorldPos& place) {
    const double time = track.points.empty() ? 0.0 : track.points.back().time + wait;
    TrackPoint point;
    point.time = time;
    point.position_world = place;
    track.points.push_back(point);
}

std::vector<Shape> shapes() {
    test::Random random(44);
    const auto noise = [&](double size) {
        return WorldPos(random.between(-size, size), random.between(-size, size),
                        random.between(-size, size));
    };
    std::vector<Shape> all;
    all.push_back({"a landing, then ten minutes of drift",
                   track_of({0, 1, 601, 602}, {WorldPos(0, 0, 500), WorldPos(10, 0, 495),
                                               WorldPos(11, 0, 495), WorldPos(21, 0, 495)})});
    const auto make = [&](const std::string& name, int count, const auto& next) {
        Track track;
        track.has_times = track.has_heights = true;
        WorldPos place(0.0, 0.0, 2000.0);
        for (int i = 0; i < count; ++i) add(track, next(i, place), place);
        all.push_back({name, std::move(track)});
    };
    make("a standstill with noise", 200, [&](int, WorldPos& place) {
        place = WorldPos(0, 0, 2000) + noise(2.0);
        return 1.0;
    });
    make("pauses", 60, [&](int i, WorldPos& place) {
        const bool is_pause = i % 12 == 11;
        place += is_pause ? noise(0.5) : WorldPos(25.0, 4.0 * (i % 3), random.between(-3.0, 3.0));
        return is_pause ? 300.0 : 1.0;
    });
    make("gaps of minutes", 60, [&](int i, WorldPos& place) {
        place += noise(i % 7 == 0 ? 5000.0 : 20.0);
        return i % 7 == 0 ? random.between(60.0, 900.0) : 1.0;
    });
    make("one point an hour", 20, [&](int, WorldPos& place) {
        place += noise(4000.0);
        return 3600.0;
    });
    make("nearly equal times", 60, [&](int i, WorldPos& place) {
        place += noise(10.0);
        return i % 3 == 0 ? 1e-3 : 1.0;
    });
    make("there and back", 40, [&](int i, WorldPos& place) {
        place += WorldPos(i % 2 == 0 ? 100.0 : -100.0, 0.0, i % 4 < 2 ? 10.0 : -10.0);
        return i % 5 == 0 ? 40.0 : 4.0;
    });
    make("circles in rising air", 120, [&](int i, WorldPos& place) {
        place = WorldPos(60.0 * std::cos(0.25 * i), 60.0 * std::sin(0.25 * i), 2000.0 + 2.0 * i);
        return 1.0;
    });
    for (int i = 0; i < 20; ++i) {
        make("steps of any length in any time " + std::to_string(i), 40, [&](int, WorldPos& place) {
            place += std::pow(10.0, random.between(-1.0, 3.5)) * random.direction();
            return std::pow(10.0, random.between(-2.0, 3.5));
        });
    }
    return all;
}

CameraPath follow(Track track, const CameraPathSettings& settings = {}) {
    Result<CameraPath> path = CameraPath::create(std::move(track), low_hills(), settings);
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

/// Calls `check` with each segment of a track and times in it: close to both ends, and between.
template <class Check>
void for_each_time(const Track& track, const Check& check) {
    for (std::size_t i = 0; i + 1 < track.points.size(); ++i) {
        const double from = track.points[i].time, span = track.points[i + 1].time - from;
        for (int j = 0; j <= 64; ++j) check(i, from + span * j / 64.0);
        for (double after = 0.1; after < std::min(8.0, span); after += 0.1) {
            check(i, from + after);
            check(i, from + span - after);
        }
    }
}

TEST(TrackCurves, StayWithinTheirBoundsOfThePolylineWhateverTheIntervals) {
    for (const auto& [name, track] : shapes()) {
        SCOPED_TRACE(name);
        const CameraPath path = follow(track);
        double worst_chord = 0.0, worst_seconds = 0.0, worst_height = 0.0;
        for_each_time(track, [&, &points = track.points](std::size_t i, double time) {
            const TrackPoint &from = points[i], &to = points[i + 1];
            const Eigen::Vector3d chord = to.position_world - from.position_world;
            const double span = to.time - from.time, share = (time - from.time) / span;
            const WorldPos eye = path.at(time).eye_world;
            const double off = (eye - from.position_world - share * chord).norm();
            const double slack = 1e-9 * (1.0 + from.position_world.norm());
            worst_chord = std::max(worst_chord, off - kMostOfChord * chord.norm() - slack);
            worst_seconds =
                std::max(worst_seconds, off - kMostSeconds * chord.norm() / span - slack);
            const auto [low, high] = std::minmax(from.position_world.z(), to.position_world.z());
            worst_height = std::max({worst_height, low - eye.z() - slack, eye.z() - high - slack});
        });
        EXPECT_EQ(worst_chord, 0.0) << "metres beyond the bound";
        EXPECT_EQ(worst_seconds, 0.0) << "metres beyond the bound";
        EXPECT_EQ(worst_height, 0.0) << "metres beyond the heights of both points";
    }
}

TEST(TrackCurves, ALandingFollowedByDriftLeavesItsPointsByNothing) {
    const CameraPath path = follow(shapes().front().track);
    for (double time = 0.0; time <= path.duration(); time += 0.125) {
        const WorldPos eye = path.at(time).eye_world;
        EXPECT_GE(eye.x(), 0.0) << time;
        EXPECT_LE(eye.x(), 21.0) << time;
        EXPECT_GE(eye.z(), 495.0) << time;
        EXPECT_LE(eye.z(), 500.0) << time;
    }
}

TEST(TrackCurves, VelocityIsContinuousAndTheRateOfThePosition) {
    for (const auto& [name, track] : shapes()) {
        SCOPED_TRACE(name);
        const CameraPath path = follow(track);
        for (std::size_t i = 1; i + 1 < track.points.size(); ++i) {
            const auto& p = track.points;
            const double before = p[i].time - p[i - 1].time, after = p[i + 1].time - p[i].time;
            const double step = 1e-5 * std::min({before, after, 1.0}), time = p[i].time;
            const Eigen::Vector3d left = path.at(time - step).velocity,
                                  right = path.at(time + step).velocity;
            const Eigen::Vector3d moved =
                path.at(time + step).eye_world - path.at(time - step).eye_world;
            const double speed =
                std::max((p[i].position_world - p[i - 1].position_world).norm() / before,
                         (p[i + 1].position_world - p[i].position_world).norm() / after);
            EXPECT_LT((right - left).norm(), 1e-3 * speed + 1e-9) << i;
            EXPECT_LT((0.5 * moved / step - 0.5 * (left + right)).norm(), 1e-3 * speed + 1e-4) << i;
        }
    }
}

TEST(TrackCurves, RecordedTracksMoveByLittleMoreThanTwoSecondsOfMotion) {
    for (auto& [name, track] : shapes()) {
        SCOPED_TRACE(name);
        Track recorded = track;
        recorded.is_recorded = true;
        for (TrackPoint& point : recorded.points)
            point.position_world.z() += 1e5;  // no ground is near
        const CameraPath path = follow(recorded);
        const auto& p = recorded.points;
        const auto speed_around = [&](double time) {
            double most = 0.0;
            for (std::size_t i = 0; i + 1 < p.size(); ++i) {
                if (p[i + 1].time < time - kReachRecorded || p[i].time > time + kReachRecorded)
                    continue;
                most = std::max(most, (p[i + 1].position_world - p[i].position_world).norm() /
                                          (p[i + 1].time - p[i].time));
            }
            return most;
        };
        double worst = 0.0;
        for_each_time(recorded, [&](std::size_t i, double time) {
            const double share = (time - p[i].time) / (p[i + 1].time - p[i].time);
            const WorldPos on_line =
                (1.0 - share) * p[i].position_world + share * p[i + 1].position_world;
            const double off = (path.at(time).eye_world - on_line).norm();
            worst = std::max(worst, off - kMostRecorded * speed_around(time) - 1e-4);
        });
        EXPECT_EQ(worst, 0.0) << "metres beyond the bound";
        EXPECT_LT((path.at(0.0).eye_world - p.front().position_world).norm(), 1e-6);
        EXPECT_LT((path.at(path.duration()).eye_world - p.back().position_world).norm(), 1e-6);
    }
}

TEST(TrackCurves, SmoothingTakesTheNoiseOutOfRecordedTracks) {
    test::Random random(7);
    Track track;
    track.has_times = track.has_heights = true;
    for (int i = 0; i < 400; ++i) {
        add(track, 1.0, WorldPos(20.0 * i, random.between(-2.0, 2.0), 3000.0));
    }
    const auto spread = [&](const CameraPath& path) {
        double sum = 0.0;
        for (int i = 10; i < 390; ++i) sum += std::pow(path.at(i).eye_world.y(), 2);
        return std::sqrt(sum / 380.0);
    };
    const double noisy = spread(follow(track));
    track.is_recorded = true;
    EXPECT_LT(spread(follow(track)), 0.6 * noisy);
}

// Points of a straight line with very different distances.
TEST(TrackCurves, RecordedTracksWithoutTimesStayOnTheirLineAndHoldTheirSpeed) {
    Track track;
    track.has_heights = track.is_recorded = true;
    double x = 0.0;
    for (int i = 0; i < 25; ++i) {
        add(track, 0.0, WorldPos(x, 0.0, 3000.0));
        x += i >= 10 && i < 15 ? 100.0 : 0.1;
    }
    const double length = track.points.back().position_world.x();
    const CameraPath path = follow(track, {.speed = 50.0});
    EXPECT_NEAR(path.duration(), length / 50.0, 1e-9);
    double last = 0.0;
    for (double time = 0.0; time <= path.duration(); time += 1.0 / 64.0) {
        const CameraPose pose = path.at(time);
        EXPECT_NEAR(pose.eye_world.x(), 50.0 * time, 1e-6);
        EXPECT_NEAR(pose.eye_world.y(), 0.0, 1e-9);
        EXPECT_NEAR(pose.velocity.x(), 50.0, 1e-6) << time;
        EXPECT_GE(pose.eye_world.x(), last);
        last = pose.eye_world.x();
    }
    EXPECT_NEAR(path.at(path.duration()).eye_world.x(), length, 1e-9);
}

// A right angle with points 5 m apart. Smoothing moves it by 5 m at most at any speed, and times fit what it gave.
TEST(TrackCurves, RecordedTracksWithoutTimesAreSmoothedByLengthBeforeTheyAreTimed) {
    constexpr double kSide = 500.0, kChord = 5.0;
    Track track;
    track.has_heights = track.is_recorded = true;
    for (double x = 0.0; x <= kSide; x += kChord) add(track, 0.0, WorldPos(x, 0.0, 3000.0));
    for (double y = kChord; y <= kSide; y += kChord) add(track, 0.0, WorldPos(kSide, y, 3000.0));
    for (const double speed : {5.0, 50.0, 500.0}) {
        const CameraPath path = follow(track, {.speed = speed});
        const double step = 0.01 * kChord / speed;
        for (double time = 0.0; time <= path.duration(); time += step) {
            const CameraPose pose = path.at(time);
            const double off =
                std::min(std::abs(pose.eye_world.y()), std::abs(pose.eye_world.x() - kSide));
            ASSERT_LE(off, 5.0 + kMostOfChord * kChord) << speed << " " << time;
            ASSERT_NEAR(pose.velocity.norm(), speed, 0.1 * speed) << time;
        }
    }
}

// Recorded times smooth also where a speed is given: 20 s of noise at a standstill are no way.
TEST(TrackCurves, RecordedTracksFlownAtASpeedAreSmoothedByTheirTimesFirst) {
    test::Random random(3);
    Track track;
    track.has_times = track.has_heights = track.is_recorded = true;
    double length = 0.0;
    for (int i = 0; i < 100; ++i) {
        const bool stands = i >= 40 && i < 60;
        const double x = 10.0 * (i < 40 ? i : stands ? 40 : i - 20);
        const double y = stands ? random.between(-2.0, 2.0) : 0.0;
        add(track, 1.0, WorldPos(x, y, 3000.0));
        if (i == 0) continue;
        const auto& p = track.points;
        length += (p[p.size() - 1].position_world - p[p.size() - 2].position_world).norm();
    }
    const double straight = track.points.back().position_world.x();
    const CameraPath path = follow(track, {.speed = 30.0});
    EXPECT_GT(length - straight, 20.0);
    EXPECT_LT(30.0 * path.duration() - straight, 0.6 * (length - straight));
}

}  // namespace track_curve_test
}  // namespace terrane
