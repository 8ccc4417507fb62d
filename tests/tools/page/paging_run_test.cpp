// SPDX-License-Identifier: MIT
#include "lab/paging_run.h"

#include "support/heights/wave_heights.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {
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
        EXPECT_EQ(run.totals.excess_error_px_s, 0.0) << name_of(policy);
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
    double excess = 0.0, most = 0.0;
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        const FrameRecord& frame = run.frames[i];
        EXPECT_DOUBLE_EQ(frame.time, static_cast<double>(i) / 15.0);
        if (frame.error_px > 2.0 && frame.status == MeshStatus::not_resident) {
            ++late;
            excess += (frame.error_px - 2.0) / 15.0;
        }
        most = std::max(most, frame.error_px);
        contact_late += run.contact_late[i];
        EXPECT_LE(frame.paging.resident_bytes + frame.paging.in_flight_bytes,
                  std::size_t{64} << 20);
    }
    EXPECT_GT(late, 10u) << "or it says little";
    EXPECT_EQ(run.totals.late_frames, late);
    EXPECT_DOUBLE_EQ(run.totals.excess_error_px_s, excess);
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
