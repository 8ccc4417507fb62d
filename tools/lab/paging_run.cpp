// SPDX-License-Identifier: MIT
//
// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (positions
//          of bodies).
#include "lab/paging_run.h"

#include "flight/flight_options.h"
#include "program/progress.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {

WorldPos GroundBodies::place(std::size_t body, const CameraPose& camera) const {
    constexpr double kSide = 300.0;  // metres
    const auto i = static_cast<double>(body);
    const Eigen::Vector2d share(0.5 + 0.7548776662466927 * i, 0.5 + 0.5698402909980532 * i);
    const Eigen::Vector2d from_middle =
        share - share.array().floor().matrix() - Eigen::Vector2d(0.5, 0.5);
    const Eigen::Vector2d p = camera.eye_world.head<2>() + kSide * from_middle;
    return {p.x(), p.y(), source_->height(p.x(), p.y()) + kRadius};
}

std::vector<BodyNeed> GroundBodies::needs(const CameraPose& camera) const {
    constexpr double kStep = 1.0 / 64.0;  // seconds
    CameraPose next = camera;
    next.eye_world += kStep * camera.velocity;
    std::vector<BodyNeed> needs;
    needs.reserve(count_);
    for (std::size_t body = 0; body < count_; ++body) {
        const WorldPos now = place(body, camera);
        needs.push_back({.centre_world = now,
                         .velocity = (place(body, next) - now) / kStep,
                         .radius = kRadius});
    }
    return needs;
}

std::vector<BodyMoment> GroundBodies::trajectory(std::size_t body, std::span<const PathMoment> path,
                                                 double clock) const {
    std::vector<BodyMoment> trajectory;
    trajectory.reserve(path.size());
    for (const PathMoment& moment : path) {
        trajectory.push_back({clock + moment.time, place(body, moment.pose)});
    }
    return trajectory;
}

bool has_ground(const ResidentSet& resident, int level, const WorldPos& centre_world,
                double radius) {
    const Lattice& lattice = resident.lattice();
    const WorldRect& extent = resident.extent();
    const double west = std::max(centre_world.x() - radius, extent.west);
    const double east = std::min(centre_world.x() + radius, extent.east);
    const double south = std::max(centre_world.y() - radius, extent.south);
    const double north = std::min(centre_world.y() + radius, extent.north);
    if (west > east || south > north) return true;
    const double side = lattice.level_spacing(level) * kChunkCells;
    const auto index = [side](double place, double origin) {
        return static_cast<std::int32_t>(std::floor((place - origin) / side));
    };
    for (std::int32_t y = index(south, lattice.origin_y); y <= index(north, lattice.origin_y);
         ++y) {
        for (std::int32_t x = index(west, lattice.origin_x); x <= index(east, lattice.origin_x);
             ++x) {
            const ChunkKey key{x, y, static_cast<std::uint8_t>(level)};
            // at the edge of the extent the chunk may be outside the world
            if (lattice.contains(key) && resident.find_ground(key) == nullptr) return false;
        }
    }
    return true;
}

Foresight::Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings)
    : path_(&path), bodies_(&bodies), settings_(settings), body_trajectories_(bodies.count()) {
    if (!settings_.is_complete) return;
    const std::vector<PathMoment> moments = path_moments(path);
    camera_trajectory_ = camera_trajectory(moments, settings_.clock);
    for (std::size_t body = 0; body < bodies.count(); ++body) {
        body_trajectories_[body] = bodies.trajectory(body, moments, settings_.clock);
    }
}

void Foresight::set_trajectories(double time, CameraNeed& camera, std::span<BodyNeed> bodies) {
    if (settings_.is_complete) {
        const double now = settings_.clock + time;
        camera.trajectory = trajectory_ahead(std::span<const CameraMoment>(camera_trajectory_), now,
                                             settings_.horizon);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            bodies[i].trajectory = trajectory_ahead(
                std::span<const BodyMoment>(body_trajectories_[i]), now, settings_.horizon);
        }
        return;
    }
    const auto jump = std::upper_bound(path_->jumps().begin(), path_->jumps().end(), time);
    if (jump != path_->jumps().end() && *jump <= time + settings_.announce) {
        announce_jump(time, *jump, camera, bodies);
    }
}

// The trajectory of an announced jump: linear at the current velocity up to the jump, then linear from its target.
void Foresight::announce_jump(double time, double jump, CameraNeed& camera,
                              std::span<BodyNeed> bodies) {
    const CameraPose now = path_->at(time);
    CameraPose leaving = now, arriving = path_->at(jump), last = arriving;
    const double rest = std::max(0.0, time + settings_.horizon - jump);
    leaving.eye_world += (jump - time) * now.velocity;
    last.eye_world += rest * arriving.velocity;
    const std::array<PathMoment, 4> moments{
        PathMoment{time, false, now}, PathMoment{jump, true, leaving},
        PathMoment{jump, false, arriving}, PathMoment{jump + rest, false, last}};
    camera_trajectory_ = camera_trajectory(moments, settings_.clock);
    camera.trajectory = camera_trajectory_;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        body_trajectories_[i] = bodies_->trajectory(i, moments, settings_.clock);
        bodies[i].trajectory = body_trajectories_[i];
    }
}

namespace {

// The pager's time at the start of a flight, seconds: later than any time at which the first frame is loaded, and small
// enough for times to be exact to a nanosecond.
constexpr double kClock = 0x1p20;
// Length of trajectories beyond the pager's horizon, seconds.
constexpr double kBeyondHorizon = 1.0;

// Loads what the first frame needs; retries failed loads after the pager's delay.
Result<void> load_first_frame(FrameMaker& maker, const View& view,
                              std::span<const BodyNeed> bodies) {
    constexpr int kMostTries = 64;
    constexpr double kLongestRetry = 11.0;  // seconds; the pager waits 10 at most
    for (int i = 0; i < kMostTries; ++i) {
        const std::uint64_t failed = maker.pager().stats().failed;
        maker.load_until_stable(view, bodies, i * kLongestRetry);
        if (maker.pager().stats().failed == failed) break;
    }
    if (maker.pager().resident()->has_roots()) return {};
    if (is_interrupted()) return fail(ErrorCode::cancelled, "interrupted");
    return fail(ErrorCode::io, "the storage never gave the root squares");
}

std::size_t count_without_ground(const Pager& pager, std::span<const BodyNeed> bodies) {
    const std::shared_ptr<const ResidentSet> resident = pager.resident();
    return static_cast<std::size_t>(std::ranges::count_if(bodies, [&](const BodyNeed& body) {
        return !has_ground(*resident, pager.contact_level(), body.centre_world, body.radius);
    }));
}

PagingTotals add_up(const PagingRun& run, const PagerStats& before, double fps) {
    PagingTotals totals;
    totals.frames = run.frames.size();
    totals.excess_error = add_up_excess_error(run.frames, fps);
    for (const FrameRecord& frame : run.frames) {
        if (frame.is_late()) ++totals.late_frames;
        totals.error_px_max = std::max(totals.error_px_max, frame.error_px);
    }
    for (const std::size_t late : run.contact_late) totals.contact_late += late;
    const PagerStats& after = run.frames.back().paging;
    totals.bytes_loaded = after.bytes_read - before.bytes_read;
    // a flight may also use chunks read before it, and so more bytes than it loaded
    const std::uint64_t used = after.bytes_used - before.bytes_used;
    totals.bytes_wasted = totals.bytes_loaded - std::min(used, totals.bytes_loaded);
    totals.peak_bytes = after.peak_bytes;
    totals.loaded = after.loaded - before.loaded;
    totals.reloads = after.reloaded - before.reloaded;
    totals.evicted = after.evicted - before.evicted;
    totals.hard_evictions = after.hard_evictions - before.hard_evictions;
    totals.cancelled = after.cancelled - before.cancelled;
    totals.failed = after.failed - before.failed;
    totals.timed_out = after.timed_out - before.timed_out;
    totals.over_ceiling = after.over_ceiling - before.over_ceiling;
    return totals;
}

}  // namespace

Result<PagingRun> run_paging(std::shared_ptr<const HeightSource> source, ChunkCache& chunks,
                             const CameraPath& path, const PagingRunSettings& settings) {
    FrameMakerSettings maker_settings = settings.maker;
    maker_settings.pager.policy = pager_policy(settings.policy);
    const double horizon = maker_settings.pager.horizon;
    TERRANE_TRY(std::unique_ptr<VirtualLoader> loader,
                VirtualLoader::create(settings.storage,
                                      [&chunks](const ChunkKey& key) { return chunks.get(key); }));
    TERRANE_TRY(FrameMaker maker, FrameMaker::create(source, maker_settings, std::move(loader)));

    const GroundBodies bodies(*source, settings.body_count);
    Foresight foresight(path, bodies,
                        {.is_complete = settings.policy == PagingChoice::oracle,
                         .announce = settings.announce,
                         .horizon = horizon + kBeyondHorizon,
                         .clock = kClock});
    const CameraPose start = path.at(0.0);
    TERRANE_TRY(load_first_frame(maker, view_at(settings.view, start), bodies.needs(start)));
    const PagerStats before = maker.pager().stats();

    PagingRun run;
    run.frames.reserve(settings.frame_count);
    for (std::size_t i = 0; i < settings.frame_count; ++i) {
        if (is_interrupted()) return fail(ErrorCode::cancelled, "interrupted");
        const double time = static_cast<double>(i) / settings.fps;
        const CameraPose pose = path.at(time);
        CameraNeed camera{.view = view_at(settings.view, pose), .velocity = pose.velocity};
        std::vector<BodyNeed> needs = bodies.needs(pose);
        foresight.set_trajectories(time, camera, needs);
        run.frames.push_back(maker.make(camera, needs, kClock + time).record);
        run.frames.back().time = time;
        run.contact_late.push_back(count_without_ground(maker.pager(), needs));
        if (settings.frames_done != nullptr) ++*settings.frames_done;
    }
    run.totals = add_up(run, before, settings.fps);
    run.totals.body_frames = settings.frame_count * settings.body_count;
    return run;
}

Result<void> play_all(std::shared_ptr<const HeightSource> source, ChunkCache& chunks,
                      std::span<const PagingJob> jobs, std::size_t thread_count,
                      const std::function<Result<void>(std::size_t, PagingRun)>& take,
                      const std::function<void()>& show) {
    constexpr std::chrono::milliseconds kBetweenShows(100);
    std::mutex mutex;
    std::condition_variable done;
    std::size_t next = 0;
    std::vector<std::optional<Result<PagingRun>>> runs(jobs.size());
    const auto play = [&](std::size_t job) -> Result<PagingRun> {
        try {
            return run_paging(source, chunks, *jobs[job].path, jobs[job].settings);
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::out_of_memory, "out of memory");
        }
    };
    const auto work = [&](const std::stop_token& stop) {
        for (;;) {
            std::size_t job = 0;
            {
                const std::lock_guard lock(mutex);
                if (next == jobs.size() || stop.stop_requested()) return;
                job = next++;
            }
            Result<PagingRun> run = play(job);
            const std::lock_guard lock(mutex);
            runs[job].emplace(std::move(run));
            done.notify_all();
        }
    };
    // declared last: the threads end before the objects that they use
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < std::min(thread_count, jobs.size()); ++i) {
        threads.emplace_back(work);
    }
    for (std::size_t job = 0; job < jobs.size(); ++job) {
        std::unique_lock lock(mutex);
        while (!done.wait_for(lock, kBetweenShows, [&] { return runs[job].has_value(); })) show();
        Result<PagingRun> run = std::move(*runs[job]);
        runs[job].reset();
        lock.unlock();
        const Result<void> taken =
            run ? take(job, std::move(*run)) : Result<void>(tl::unexpected(run.error()));
        if (!taken) {
            for (std::jthread& thread : threads) thread.request_stop();
            return taken;
        }
    }
    return {};
}

}  // namespace terrane::tools
