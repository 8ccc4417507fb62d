// SPDX-License-Identifier: MIT
#include "lab/paging_run.h"

#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace ground_bodies_test {

const test::WaveHeights& hills() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    return source;
}

CameraPose pose_at(double x, double y, double z) {
    CameraPose pose;
    pose.eye_world = {x, y, z};
    pose.velocity = {80.0, -60.0, 5.0};
    return pose;
}

TEST(GroundBodies, RestOnTheGroundUnderAndAroundTheEye) {
    const GroundBodies bodies(hills(), 9);
    const CameraPose pose = pose_at(500.0, -300.0, 900.0);
    std::vector<WorldPos> places;
    for (std::size_t i = 0; i < 9; ++i) {
        const WorldPos p = bodies.place(i, pose);
        EXPECT_EQ(p.z(), hills().height(p.x(), p.y()) + GroundBodies::kRadius);
        EXPECT_LE((p - pose.eye_world).head<2>().cwiseAbs().maxCoeff(), 150.0);
        for (const WorldPos& other : places) EXPECT_GT((p - other).norm(), 20.0);
        places.push_back(p);
    }
    EXPECT_EQ(places[0].head<2>(), pose.eye_world.head<2>());
    EXPECT_TRUE(GroundBodies(hills(), 0).needs(pose).empty());
}

TEST(GroundBodies, MoveWithTheCameraAndTheGround) {
    const GroundBodies bodies(hills(), 5);
    const CameraPose pose = pose_at(500.0, -300.0, 900.0);
    CameraPose later = pose;
    constexpr double kStep = 1e-3;
    later.eye_world += kStep * pose.velocity;
    const std::vector<BodyNeed> needs = bodies.needs(pose);
    for (std::size_t i = 0; i < 5; ++i) {
        const Eigen::Vector3d rate = (bodies.place(i, later) - bodies.place(i, pose)) / kStep;
        EXPECT_EQ(needs[i].centre_world, bodies.place(i, pose));
        EXPECT_LT((needs[i].velocity - rate).norm(), 1.0) << i;
        EXPECT_NEAR(needs[i].velocity.x(), 80.0, 1e-6);
        EXPECT_EQ(needs[i].radius, GroundBodies::kRadius);
    }
}

// Reference: tests every chunk of the level.
bool has_ground_slowly(const ResidentSet& set, int level, const WorldPos& p, double radius) {
    const Lattice& lattice = set.lattice();
    const WorldRect& extent = set.extent();
    const double side = lattice.level_spacing(level) * kChunkCells;
    const std::int32_t count = lattice.root_count_x << level;
    for (std::int32_t j = 0; j < count; ++j) {
        for (std::int32_t i = 0; i < count; ++i) {
            const std::int32_t x = (lattice.first_root_x << level) + i;
            const std::int32_t y = (lattice.first_root_y << level) + j;
            const double west = std::max(lattice.origin_x + x * side, extent.west);
            const double south = std::max(lattice.origin_y + y * side, extent.south);
            const double east = std::min(lattice.origin_x + (x + 1) * side, extent.east);
            const double north = std::min(lattice.origin_y + (y + 1) * side, extent.north);
            const bool touches = p.x() + radius >= west && p.x() - radius < east &&
                                 p.y() + radius >= south && p.y() - radius < north;
            const ChunkKey key{x, y, static_cast<std::uint8_t>(level)};
            if (touches && set.find_ground(key) == nullptr) return false;
        }
    }
    return true;
}

TEST(HasGround, AgreesWithATestOfEveryChunk) {
    constexpr std::uint64_t kSeed = 20240607;
    test::Random random(kSeed);
    const Lattice lattice = test::small_world(2, 8.0);
    const test::WaveHeights source(lattice, 50.0, 900.0);
    int with = 0, without = 0;
    for (int round = 0; round < 4; ++round) {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        std::vector<ChunkKey> open{{-1, -1, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 0}};
        while (!open.empty()) {
            const ChunkKey key = open.back();
            open.pop_back();
            chunks.push_back(*make_chunk(source, key));
            if (key.level == lattice.finest_level) continue;
            for (int quadrant = 0; quadrant < 4; ++quadrant) {
                if (random.between(0.0, 1.0) < 0.8) open.push_back(key.child(quadrant));
            }
        }
        const ResidentSet set(lattice, source.extent(), std::move(chunks), 1);
        for (int i = 0; i < 500; ++i) {
            const double reach = 1.2 * source.extent().east;
            const WorldPos p(random.between(-reach, reach), random.between(-reach, reach), 0.0);
            const double radius = random.between(0.0, 600.0);
            const bool found = has_ground(set, lattice.finest_level, p, radius);
            EXPECT_EQ(found, has_ground_slowly(set, lattice.finest_level, p, radius))
                << "seed " << kSeed << ": " << p.transpose() << ", " << radius;
            ++(found ? with : without);
        }
    }
    EXPECT_GT(with, 300);
    EXPECT_GT(without, 300);
}

TEST(HasGround, BeyondTheTerrainNothingIsMissing) {
    const Lattice lattice = test::small_world(1, 8.0);
    const test::WaveHeights source(lattice, 50.0, 900.0);
    const ResidentSet none(lattice, source.extent(), {}, 1);
    const double east = source.extent().east;
    EXPECT_FALSE(has_ground(none, 1, {east - 0.5, 0.0, 0.0}, 1.0));
    EXPECT_FALSE(has_ground(none, 1, {east + 0.5, 0.0, 0.0}, 1.0));
    EXPECT_TRUE(has_ground(none, 1, {east + 1.5, 0.0, 0.0}, 1.0));
}

}  // namespace ground_bodies_test

namespace foresight_test {

constexpr double kClock = 1000.0;

using ground_bodies_test::hills;

CameraPath make(const std::string& name, double seconds) {
    Result<CameraPath> path =
        CameraPath::create(name, hills(), {.speed = 50.0, .altitude = 200.0, .seconds = seconds});
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

TEST(PathMoments, GoToTheEndWithoutGapsAndAJumpIsTwoOfOneTime) {
    for (const auto& [name, seconds] : {std::pair("straight", 3.02), std::pair("teleports", 12.0),
                                        std::pair("teleports", 12.02)}) {
        SCOPED_TRACE(testing::Message() << name << " " << seconds);
        const CameraPath path = make(name, seconds);
        const std::vector<PathMoment> moments = path_moments(path);
        EXPECT_EQ(moments.front().time, 0.0);
        EXPECT_EQ(moments.back().time, path.duration());
        std::vector<double> jumps;
        for (std::size_t i = 1; i < moments.size(); ++i) {
            const PathMoment &last = moments[i - 1], &moment = moments[i];
            EXPECT_GE(moment.time, last.time);
            EXPECT_LT(moment.time, last.time + 0.051);
            const double distance = (moment.pose.eye_world - last.pose.eye_world).norm();
            if (!moment.is_before_jump) {
                EXPECT_EQ(moment.pose.eye_world, path.at(moment.time).eye_world);
            }
            if (moment.time > last.time) {
                EXPECT_LT(distance, 10.0) << "nothing goes between the two ends of a jump";
                continue;
            }
            jumps.push_back(moment.time);
            EXPECT_TRUE(last.is_before_jump);
            EXPECT_EQ(last.pose.eye_world, path.before(moment.time).eye_world);
            EXPECT_GT(distance, 1000.0);
        }
        EXPECT_EQ(jumps, (name == std::string("straight") ? std::vector<double>{}
                                                          : std::vector<double>{5.0, 10.0}));
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

namespace paging_run_test {

std::shared_ptr<const HeightSource> hills() {
    static const std::shared_ptr<const HeightSource> source =
        FractalHeights::create({.seed = 5,
                                .octave_count = 11,
                                .amplitude = 200.0,
                                .wavelength_log2 = 11,
                                .finest_spacing_log2 = 1,
                                .root_size_log2 = 13})
            .value();
    return source;
}

constexpr double kSeconds = 8.0;

CameraPath make_path(const std::string& name, double speed) {
    Result<CameraPath> path =
        CameraPath::create(name, *hills(), {.speed = speed, .altitude = 60.0, .seconds = kSeconds});
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

PagingRunSettings make_settings(PagingChoice policy) {
    PagingRunSettings settings;
    settings.policy = policy;
    settings.maker.triangulator.max_error_px = 2.0;
    settings.maker.triangulator.triangle_budget = 200'000;
    settings.maker.pager.memory_bytes = std::size_t{64} << 20;
    settings.view.width_px = 640;
    settings.view.height_px = 360;
    settings.fps = 15.0;
    settings.frame_count = static_cast<std::size_t>(kSeconds * settings.fps);
    settings.body_count = 4;
    return settings;
}

PagingRunSettings fast(PagingChoice policy) {
    PagingRunSettings settings = make_settings(policy);
    settings.storage.latency = 0.0;
    settings.storage.bandwidth = 1e9;
    settings.storage.slots = 64;
    return settings;
}

PagingRunSettings slow(PagingChoice policy) {
    PagingRunSettings settings = make_settings(policy);
    settings.storage.latency = 0.1;
    settings.storage.bandwidth = 4e6;
    return settings;
}

PagingRun play(const CameraPath& path, const PagingRunSettings& settings) {
    ChunkCache chunks(hills(), std::size_t{256} << 20);
    Result<PagingRun> run = run_paging(hills(), chunks, path, settings);
    EXPECT_TRUE(run) << run.error().message;
    return std::move(*run);
}

void expect_equal(const PagingRun& a, const PagingRun& b) {
    ASSERT_EQ(a.frames.size(), b.frames.size());
    EXPECT_EQ(a.contact_late, b.contact_late);
    for (std::size_t i = 0; i < a.frames.size(); ++i) {
        const FrameRecord &p = a.frames[i], &q = b.frames[i];
        ASSERT_EQ(p.error_px, q.error_px) << i;
        ASSERT_EQ(p.triangles, q.triangles) << i;
        ASSERT_EQ(p.paging.resident_bytes, q.paging.resident_bytes) << i;
        ASSERT_EQ(p.paging.in_flight_bytes, q.paging.in_flight_bytes) << i;
        ASSERT_EQ(p.paging.bytes_read, q.paging.bytes_read) << i;
        ASSERT_EQ(p.paging.bytes_used, q.paging.bytes_used) << i;
        ASSERT_EQ(p.paging.peak_bytes, q.paging.peak_bytes) << i;
    }
}

TEST(PagingRun, FastStorageIsNeverLate) {
    const CameraPath path = make_path("straight", 100.0);
    for (const PagingChoice policy : {PagingChoice::deadline, PagingChoice::oracle}) {
        const PagingRun run = play(path, fast(policy));
        EXPECT_EQ(run.totals.late_frames, 0u) << name_of(policy);
        EXPECT_EQ(run.totals.contact_late, 0u) << name_of(policy);
        EXPECT_EQ(run.totals.excess_error.late_px_s, 0.0) << name_of(policy);
        EXPECT_GT(run.totals.loaded, 5u) << name_of(policy);
        EXPECT_EQ(run.totals.frames, 120u);
        EXPECT_EQ(run.totals.body_frames, 480u);
    }
}

TEST(PagingRun, WhatTheFirstFrameNeedsIsLoadedBeforeTheClockStarts) {
    const PagingRun run = play(make_path("straight", 0.01), slow(PagingChoice::deadline));
    EXPECT_EQ(run.totals.late_frames, 0u);
    EXPECT_EQ(run.totals.contact_late, 0u);
    EXPECT_EQ(run.totals.bytes_loaded, 0u);
    EXPECT_EQ(run.totals.bytes_wasted, 0u);
    EXPECT_EQ(run.totals.loaded, 0u);
    EXPECT_GT(run.totals.peak_bytes, std::size_t{1} << 20);
}

TEST(PagingRun, TotalsAreWhatTheFramesSay) {
    const PagingRun run = play(make_path("straight", 300.0), slow(PagingChoice::distance));
    std::size_t late = 0, contact_late = 0;
    double excess = 0.0, late_excess = 0.0, most = 0.0;
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        const FrameRecord& frame = run.frames[i];
        EXPECT_DOUBLE_EQ(frame.time, static_cast<double>(i) / 15.0);
        if (frame.error_px > 2.0 && frame.status == MeshStatus::not_resident) {
            ++late;
            late_excess += (frame.error_px - 2.0) / 15.0;
        }
        excess += std::max(0.0, frame.error_px - 2.0) / 15.0;
        most = std::max(most, frame.error_px);
        contact_late += run.contact_late[i];
        EXPECT_LE(frame.paging.resident_bytes + frame.paging.in_flight_bytes,
                  std::size_t{64} << 20);
    }
    EXPECT_GT(late, 10u) << "or it says little";
    EXPECT_EQ(run.totals.late_frames, late);
    EXPECT_DOUBLE_EQ(run.totals.excess_error.all_px_s, excess);
    EXPECT_DOUBLE_EQ(run.totals.excess_error.late_px_s, late_excess);
    EXPECT_EQ(run.totals.error_px_max, most);
    EXPECT_GT(contact_late, 0u);
    EXPECT_EQ(run.totals.contact_late, contact_late);
    EXPECT_LE(run.totals.bytes_wasted, run.totals.bytes_loaded);
    // what the bandwidth allows during the flight, and transfers in flight
    EXPECT_LE(static_cast<double>(run.totals.bytes_loaded), 4e6 * kSeconds);
    EXPECT_GT(run.totals.bytes_loaded, std::uint64_t{5} << 20);
}

TEST(PagingRun, GivesTheSameBitsWhateverIsCachedAndOnAnyNumberOfThreads) {
    const CameraPath straight = make_path("straight", 200.0), spins = make_path("spins", 20.0);
    std::vector<PagingJob> jobs;
    for (const CameraPath* path : {&straight, &spins}) {
        for (const PagingChoice policy :
             {PagingChoice::deadline, PagingChoice::distance, PagingChoice::oracle}) {
            jobs.push_back({path, slow(policy)});
            jobs.back().settings.frame_count = 40;
            jobs.back().settings.storage.latency_spread = 1.0;
            jobs.back().settings.storage.failure_share = 0.05;
        }
    }
    std::vector<PagingRun> alone;
    for (const PagingJob& job : jobs) {
        ChunkCache chunks(hills(), 0);
        Result<PagingRun> run = run_paging(hills(), chunks, *job.path, job.settings);
        ASSERT_TRUE(run) << run.error().message;
        alone.push_back(std::move(*run));
    }
    for (const std::size_t threads : {1u, 3u}) {
        ChunkCache chunks(hills(), std::size_t{8} << 20);
        std::size_t next = 0;
        const Result<void> played =
            play_all(hills(), chunks, jobs, threads, [&](std::size_t job, PagingRun run) {
                EXPECT_EQ(job, next++) << "in their order";
                expect_equal(run, alone[job]);
                return Result<void>{};
            });
        EXPECT_TRUE(played) << played.error().message;
        EXPECT_EQ(next, jobs.size());
    }
}

TEST(PagingRun, AnOracleKnowsWhereJumpsLead) {
    const CameraPath path = make_path("teleports", 50.0);
    const PagingRun oracle = play(path, slow(PagingChoice::oracle));
    const PagingRun unannounced = play(path, slow(PagingChoice::deadline));
    PagingRunSettings settings = slow(PagingChoice::deadline);
    settings.announce = 4.0;
    const PagingRun announced = play(path, settings);
    EXPECT_GT(unannounced.totals.late_frames, 5u);
    EXPECT_GT(unannounced.totals.contact_late, 5u);
    EXPECT_LT(oracle.totals.late_frames, unannounced.totals.late_frames / 2);
    EXPECT_LT(announced.totals.late_frames, unannounced.totals.late_frames / 2);
    EXPECT_EQ(oracle.totals.contact_late, 0u);
    EXPECT_EQ(announced.totals.contact_late, 0u);
}

TEST(PagingRun, StorageThatAlwaysFailsIsAnError) {
    ChunkCache chunks(hills(), 0);
    PagingRunSettings settings = slow(PagingChoice::deadline);
    settings.storage.failure_share = 1.0;
    const Result<PagingRun> run =
        run_paging(hills(), chunks, make_path("straight", 50.0), settings);
    ASSERT_FALSE(run);
    EXPECT_EQ(run.error().code, ErrorCode::io);
    settings.storage.failure_share = 2.0;
    EXPECT_FALSE(run_paging(hills(), chunks, make_path("straight", 50.0), settings));
}

TEST(PagingRun, StorageThatFailsAndHangsNowAndThenOnlyDelays) {
    PagingRunSettings settings = slow(PagingChoice::deadline);
    settings.storage.failure_share = 0.3;
    settings.storage.hang_share = 0.05;
    settings.storage.timeout = 1.0;
    const PagingRun run = play(make_path("straight", 200.0), settings);
    EXPECT_GT(run.totals.failed, 0u);
    EXPECT_GT(run.totals.loaded, 5u);
}

TEST(PlayAll, StopsAtTheFirstErrorOfAFlightOrItsTaker) {
    const CameraPath path = make_path("straight", 50.0);
    ChunkCache chunks(hills(), std::size_t{64} << 20);
    PagingRunSettings quick = fast(PagingChoice::deadline);
    quick.frame_count = 3;
    std::vector<PagingJob> jobs(20, PagingJob{&path, quick});
    jobs[4].settings.storage.latency = -1.0;
    std::size_t taken = 0;
    const Result<void> broken =
        play_all(hills(), chunks, jobs, 2, [&](std::size_t, const PagingRun&) {
            ++taken;
            return Result<void>{};
        });
    EXPECT_FALSE(broken);
    EXPECT_EQ(taken, 4u);
    taken = 0;
    const Result<void> refused =
        play_all(hills(), chunks, jobs, 2, [&](std::size_t, const PagingRun&) -> Result<void> {
            if (++taken == 2) return fail(ErrorCode::io, "enough");
            return {};
        });
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "enough");
    EXPECT_EQ(taken, 2u);
    EXPECT_TRUE(play_all(hills(), chunks, {}, 2,
                         [](std::size_t, const PagingRun&) { return Result<void>{}; }));
}

TEST(ChunkCache, KeepsTheMostRecentlyUsedChunks) {
    const auto source =
        std::make_shared<const test::WaveHeights>(test::small_world(3, 8.0), 100.0, 1500.0);
    const std::size_t bytes = (*make_chunk(*source, {0, 0, 1}))->bytes();
    ChunkCache chunks(source, 2 * bytes + bytes / 2);
    const auto makes = [&](const ChunkKey& key) {
        source->sample_count = 0;
        EXPECT_TRUE(chunks.get(key));
        return source->sample_count > 0;
    };
    EXPECT_TRUE(makes({0, 0, 1}));
    EXPECT_TRUE(makes({1, 0, 1}));
    EXPECT_FALSE(makes({0, 0, 1}));
    EXPECT_TRUE(makes({0, 1, 1}));
    EXPECT_FALSE(makes({0, 0, 1}));
    EXPECT_TRUE(makes({1, 0, 1})) << "the one that was asked for longest ago";
}

TEST(ChunkCache, DoesNotKeepFailures) {
    auto source = std::make_shared<test::WaveHeights>(test::small_world(3, 8.0), 100.0, 1500.0);
    ChunkCache chunks(source, std::size_t{64} << 20);
    source->is_broken = true;
    EXPECT_FALSE(chunks.get({0, 0, 1}));
    source->is_broken = false;
    EXPECT_TRUE(chunks.get({0, 0, 1}));
}

}  // namespace paging_run_test
}  // namespace terrane::tools
