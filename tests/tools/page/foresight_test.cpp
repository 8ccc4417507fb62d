// SPDX-License-Identifier: MIT
#include "lab/paging_run.h"
#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace terrane::tools {
namespace foresight_test {

constexpr double kClock = 1000.0;

const test::WaveHeights& hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

CameraPath make(const std::string& name, double seconds) {
    Result<CameraPath> path =
        CameraPath::create(name, hills(), {.speed = 50.0, .altitude = 200.0, .seconds = seconds});
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

TEST(PathMoments, GoFromTheBeginningToTheEndWithoutGaps) {
    const CameraPath path = make("straight", 3.02);
    const std::vector<PathMoment> moments = path_moments(path);
    EXPECT_EQ(moments.front().time, 0.0);
    EXPECT_EQ(moments.back().time, path.duration());
    for (std::size_t i = 1; i < moments.size(); ++i) {
        EXPECT_GT(moments[i].time, moments[i - 1].time);
        EXPECT_LT(moments[i].time, moments[i - 1].time + 0.051);
        EXPECT_EQ(moments[i].pose.eye_world, path.at(moments[i].time).eye_world);
    }
}

TEST(PathMoments, AJumpIsTwoMomentsOfOneTime) {
    for (const double seconds : {12.0, 12.02}) {
        const CameraPath path = make("teleports", seconds);
        const std::vector<PathMoment> moments = path_moments(path);
        std::vector<double> jumps;
        for (std::size_t i = 1; i < moments.size(); ++i) {
            EXPECT_GE(moments[i].time, moments[i - 1].time);
            EXPECT_LT(moments[i].time, moments[i - 1].time + 0.051);
            const double distance =
                (moments[i].pose.eye_world - moments[i - 1].pose.eye_world).norm();
            if (moments[i].time > moments[i - 1].time) {
                EXPECT_LT(distance, 10.0) << "nothing goes between the two ends of a jump";
                continue;
            }
            jumps.push_back(moments[i].time);
            EXPECT_TRUE(moments[i - 1].is_before_jump);
            EXPECT_EQ(moments[i - 1].pose.eye_world, path.before(moments[i].time).eye_world);
            EXPECT_EQ(moments[i].pose.eye_world, path.at(moments[i].time).eye_world);
            EXPECT_GT(distance, 1000.0);
        }
        EXPECT_EQ(jumps, (std::vector<double>{5.0, 10.0}));
    }
}

TEST(TrajectoryAhead, HoldsTheMomentsAroundNowAndTheHorizon) {
    std::vector<CameraMoment> moments(7);
    const std::vector<double> times{0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0};
    for (std::size_t i = 0; i < 7; ++i) moments[i].time_s = times[i];
    const std::span<const CameraMoment> all(moments);
    const auto range = [&](double time, double horizon) {
        const std::span<const CameraMoment> trajectory = trajectory_ahead(all, time, horizon);
        return std::pair(trajectory.data() - all.data(), trajectory.size());
    };
    using Range = std::pair<std::ptrdiff_t, std::size_t>;
    EXPECT_EQ(range(-1.0, 0.5), (Range{0, 1}));
    EXPECT_EQ(range(0.5, 1.0), (Range{0, 3}));
    EXPECT_EQ(range(1.0, 0.0), (Range{1, 2}));
    EXPECT_EQ(range(2.0, 1.5), (Range{3, 3})) << "a jump of now is over";
    EXPECT_EQ(range(4.5, 10.0), (Range{5, 2}));
    EXPECT_EQ(range(9.0, 1.0), (Range{6, 1}));
    EXPECT_TRUE(trajectory_ahead(std::span<const CameraMoment>(), 1.0, 1.0).empty());
}

struct PagerNeeds {
    CameraNeed camera;
    std::vector<BodyNeed> bodies;
};

PagerNeeds needs_at(Foresight& foresight, const CameraPath& path, const GroundBodies& bodies,
                    double time) {
    PagerNeeds needs{{.view = {}, .velocity = path.at(time).velocity}, bodies.needs(path.at(time))};
    foresight.set_trajectories(time, needs.camera, needs.bodies);
    return needs;
}

TEST(Foresight, AnOracleGetsAllTrajectoriesUpToTheHorizon) {
    const CameraPath path = make("teleports", 12.0);
    const GroundBodies bodies(hills(), 3);
    Foresight foresight(path, bodies, {.is_complete = true, .horizon = 5.0, .clock = kClock});
    const PagerNeeds needs = needs_at(foresight, path, bodies, 3.02);
    EXPECT_LE(needs.camera.trajectory.front().time_s, kClock + 3.02);
    EXPECT_GE(needs.camera.trajectory.back().time_s, kClock + 8.02);
    EXPECT_LE(needs.camera.trajectory.back().time_s, kClock + 8.08);
    const auto pose = [&](double time_s) { return path.at(time_s - kClock); };
    EXPECT_LT((needs.camera.trajectory.back().eye_world -
               pose(needs.camera.trajectory.back().time_s).eye_world)
                  .norm(),
              1e-6);
    for (std::size_t i = 0; i < 3; ++i) {
        ASSERT_EQ(needs.bodies[i].trajectory.size(), needs.camera.trajectory.size());
        const BodyMoment& last = needs.bodies[i].trajectory.back();
        EXPECT_LT((last.centre_world - bodies.place(i, pose(last.time_s))).norm(), 1e-6);
    }
}

TEST(Foresight, WithoutAnAnnouncementTrajectoriesAreEmpty) {
    const CameraPath path = make("teleports", 12.0);
    const GroundBodies bodies(hills(), 2);
    Foresight foresight(path, bodies, {.announce = 0.0, .horizon = 5.0, .clock = kClock});
    for (const double time : {0.0, 4.99, 5.0, 11.0}) {
        const PagerNeeds needs = needs_at(foresight, path, bodies, time);
        EXPECT_TRUE(needs.camera.trajectory.empty()) << time;
        EXPECT_TRUE(needs.bodies[1].trajectory.empty()) << time;
    }
}

TEST(Foresight, AnAnnouncedJumpHasBothItsEndsInTheTrajectory) {
    const CameraPath path = make("teleports", 12.0);
    const GroundBodies bodies(hills(), 2);
    Foresight foresight(path, bodies, {.announce = 2.0, .horizon = 5.0, .clock = kClock});
    EXPECT_TRUE(needs_at(foresight, path, bodies, 2.9).camera.trajectory.empty());
    EXPECT_TRUE(needs_at(foresight, path, bodies, 5.0).camera.trajectory.empty())
        << "it has been made";
    const PagerNeeds needs = needs_at(foresight, path, bodies, 3.5);
    const std::span<const CameraMoment> trajectory = needs.camera.trajectory;
    ASSERT_EQ(trajectory.size(), 4u);
    EXPECT_EQ(trajectory[0].time_s, kClock + 3.5);
    EXPECT_EQ(trajectory[0].eye_world, path.at(3.5).eye_world);
    EXPECT_EQ(trajectory[1].time_s, kClock + 5.0);
    EXPECT_LT((trajectory[1].eye_world - path.before(5.0).eye_world).head<2>().norm(), 1.0)
        << "a straight path goes on as it did";
    EXPECT_EQ(trajectory[2].time_s, kClock + 5.0);
    EXPECT_EQ(trajectory[2].eye_world, path.at(5.0).eye_world);
    EXPECT_EQ(trajectory[3].time_s, kClock + 8.5);
    EXPECT_LT((trajectory[3].eye_world - path.at(8.5).eye_world).head<2>().norm(), 1.0);
    ASSERT_EQ(needs.bodies[1].trajectory.size(), 4u);
    EXPECT_EQ(needs.bodies[1].trajectory[2].centre_world, bodies.place(1, path.at(5.0)));
}

}  // namespace foresight_test
}  // namespace terrane::tools
