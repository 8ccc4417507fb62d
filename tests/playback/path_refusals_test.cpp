// SPDX-License-Identifier: MIT
//
// Settings and tracks that no path can be made of are refused with a line that names them.
#include "support/heights/wave_heights.h"

#include <terrane/playback/camera_path.h>

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace terrane {
namespace path_refusals_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const test::WaveHeights& hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

Track two_points(double last_time) {
    Track track;
    track.has_times = track.has_heights = true;
    track.points.resize(2);
    track.points[1].time = last_time;
    track.points[1].position_world = WorldPos(100.0, 0.0, 50.0);
    return track;
}

std::string refusal(const Result<CameraPath>& path) {
    return path ? std::string() : path.error().message;
}

TEST(CameraPathRefusals, NameTheSettingAndItsValue) {
    const auto refused = [](const CameraPathSettings& settings) {
        const std::string built_in = refusal(CameraPath::create("straight", hills(), settings));
        EXPECT_EQ(refusal(CameraPath::create(two_points(5.0), hills(), settings)), built_in);
        return built_in;
    };
    EXPECT_EQ(refused({}), "");
    EXPECT_EQ(refused({.speed = 0.0}), "speed must be above 0 and finite, got 0");
    EXPECT_EQ(refused({.speed = kInfinity}), "speed must be above 0 and finite, got inf");
    EXPECT_EQ(refused({.altitude = -3.0}), "altitude must be above 0 and finite, got -3");
    EXPECT_EQ(refused({.altitude = kNaN}), "altitude must be above 0 and finite, got nan");
    EXPECT_EQ(refused({.seconds = -1.0}), "seconds must be above 0 and finite, got -1");
    EXPECT_EQ(refused({.seconds = 1e300}), "seconds must be 0 to 1e+07, got 1e+300");
    EXPECT_EQ(refused({.region = WorldRect{0.0, 0.0, 10.0, 0.0}}),
              "region must have finite sides above 0, got 0 to 10 and 0 to 0");
    EXPECT_NE(refused({.region = WorldRect{-kInfinity, 0.0, 10.0, 1.0}}), "");
    EXPECT_NE(refused({.region = WorldRect{0.0, 0.0, kNaN, 1.0}}), "");
    EXPECT_EQ(refused({.start_world = WorldVec2(1.0, kNaN)}),
              "start_world must be finite, got 1, nan");
    EXPECT_EQ(refused({.start = -1.0}).substr(0, 18), "start must be 0 to");
    EXPECT_EQ(refused({.start = kNaN}).substr(0, 18), "start must be 0 to");
}

TEST(CameraPathRefusals, NameThePointOfATrack) {
    const auto refused = [](const Track& track) {
        const Result<void> good = check(track);
        EXPECT_EQ(refusal(CameraPath::create(track, hills(), {})),
                  good ? std::string() : good.error().message);
        return good ? std::string() : good.error().message;
    };
    EXPECT_EQ(refused(two_points(5.0)), "");
    EXPECT_EQ(refused({}), "a track needs two points or more, got 0");
    EXPECT_EQ(refused(two_points(0.0)),
              "point 1 of a track must be later than the one before at 0 s, got 0 s");
    EXPECT_EQ(refused(two_points(kNaN)),
              "point 1 of a track must be later than the one before at 0 s, got nan s");
    Track late = two_points(5.0);
    late.points[0].time = 1.0;
    EXPECT_EQ(refused(late), "point 0 of a track must have the time 0, got 1 s");
    Track nowhere = two_points(5.0);
    nowhere.points[1].position_world.y() = kNaN;
    EXPECT_EQ(refused(nowhere), "point 1 of a track must have a finite position");
    Track blind = two_points(5.0);
    blind.has_orientations = true;
    blind.points[0].forward.x() = kInfinity;
    EXPECT_EQ(refused(blind), "point 0 of a track must have finite directions");
}

TEST(CameraPathRefusals, NameATrackThatLastsTooLong) {
    EXPECT_EQ(refusal(CameraPath::create(two_points(1e300), hills(), {})),
              "a path lasts 1e+07 s at most, this track lasts 1e+300 s");
    EXPECT_EQ(refusal(CameraPath::create(two_points(5.0), hills(), {.start = 7.0})),
              "start must be before the track's end at 5 s, got 7 s");
}

}  // namespace path_refusals_test
}  // namespace terrane
