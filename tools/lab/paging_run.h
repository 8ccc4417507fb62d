// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "frames/frame_maker.h"
#include "frames/paging_storage.h"
#include "lab/measure.h"

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/pager.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane::tools {

/// Spheres of radius 1 m on the true ground under a camera: the first one below the eye, the others within 150 m to
/// each side. Their horizontal offsets from the eye are constant, so that they jump when the eye jumps. Their positions
/// depend only on the terrain and the camera.
class GroundBodies {
public:
    static constexpr double kRadius = 1.0;  // metres

    /// @param source must outlive the bodies
    GroundBodies(const HeightSource& source, std::size_t count) : source_(&source), count_(count) {}

    std::size_t count() const { return count_; }
    WorldPos place(std::size_t body, const CameraPose& camera) const;
    /// The needs of all bodies, which move at the camera's horizontal velocity and follow the height of the ground.
    std::vector<BodyNeed> needs(const CameraPose& camera) const;
    /// BodyNeed::trajectory of a body over a whole path.
    ///
    /// @param clock the pager's time at the start of the path, seconds
    std::vector<BodyMoment> trajectory(std::size_t body, std::span<const PathMoment> path,
                                       double clock) const;

private:
    const HeightSource* source_;
    std::size_t count_;
};

/// Whether all chunks of a level under a sphere are resident; parts beyond the world are ignored.
bool has_ground(const ResidentSet& resident, int level, const WorldPos& centre_world,
                double radius);

/// Tells a pager the known future of a path: fills CameraNeed::trajectory and BodyNeed::trajectory.
class Foresight {
public:
    struct Settings {
        bool is_complete = false;  ///< whether the whole remaining path is known, as for the oracle
        double announce = 0.0;     ///< seconds for which a jump is known ahead, if not is_complete
        double horizon = 0.0;      ///< length of the trajectories, seconds
        double clock = 0.0;        ///< the pager's time at the start of the path, seconds
    };

    /// @param path   must outlive the object
    /// @param bodies must outlive the object
    Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings);

    /// Sets the known trajectories, which are valid until the next call, and leaves the others empty.
    ///
    /// @param time seconds from the start of the path
    void set_trajectories(double time, CameraNeed& camera, std::span<BodyNeed> bodies);

private:
    void announce_jump(double time, double jump, CameraNeed& camera, std::span<BodyNeed> bodies);

    const CameraPath* path_;
    const GroundBodies* bodies_;
    Settings settings_;
    std::vector<CameraMoment> camera_trajectory_;
    std::vector<std::vector<BodyMoment>> body_trajectories_;
};

struct PagingRunSettings {
    PagingChoice policy = PagingChoice::deadline;
    FrameMakerSettings maker;  ///< the pager's policy is overwritten
    VirtualStorage storage;
    View view;  ///< size and field of view; the path sets the pose
    double fps = 30.0;
    std::size_t frame_count = 1;
    std::size_t body_count = 0;
    double announce = 0.0;  ///< seconds for which a jump is known in advance
    std::atomic<std::size_t>* frames_done =
        nullptr;  ///< counts the frames of all flights; may be null
};

/// Totals of a flight over simulated storage, excluding loads before it.
struct PagingTotals {
    std::size_t frames = 0;
    std::size_t late_frames = 0;  ///< FrameRecord::is_late()
    ExcessError excess_error;
    double error_px_max = 0.0;
    std::uint64_t bytes_loaded = 0;  ///< read from storage
    std::uint64_t bytes_wasted = 0;  ///< of these, bytes not used by the end of the flight
    std::size_t peak_bytes = 0;      ///< resident and in flight together, since creation
    std::size_t contact_late = 0;    ///< bodies without resident ground, summed over frames
    std::size_t body_frames = 0;
    std::uint64_t loaded = 0;  ///< this and the next ones as in PagerStats
    std::uint64_t reloads = 0;
    std::uint64_t evicted = 0;
    std::uint64_t hard_evictions = 0;
    std::uint64_t cancelled = 0;
    std::uint64_t failed = 0;
    std::uint64_t timed_out = 0;
    std::uint64_t over_ceiling = 0;

    double late_share() const { return ratio_or_zero(late_frames, frames); }
    double wasted_share() const { return ratio_or_zero(bytes_wasted, bytes_loaded); }
};

/// Result of a run: the same on every machine, except FrameRecord::update_ms.
struct PagingRun {
    PagingTotals totals;
    std::vector<FrameRecord> frames;
    std::vector<std::size_t> contact_late;  ///< [frames] bodies without resident ground
};

/// Plays a path against storage on a virtual clock: frame i is at time i / fps. The needs of the first frame are loaded
/// before the clock starts.
///
/// @param source the source of `chunks`
///
/// Fails: as Pager, Triangulator and VirtualLoader for their settings; io if the root squares never load; cancelled if
///        is_interrupted()
Result<PagingRun> run_paging(std::shared_ptr<const HeightSource> source, ChunkCache& chunks,
                             const CameraPath& path, const PagingRunSettings& settings);

/// One of many flights over the same terrain.
struct PagingJob {
    const CameraPath* path = nullptr;
    PagingRunSettings settings;
    std::size_t row = 0;  ///< row of the table for which the flight is played
};

/// Plays flights on several threads, and delivers their results in order on the caller's thread, each as soon as all
/// earlier ones are complete.
///
/// @param thread_count >= 1
/// @param take         called with the index of a job and its run; an error stops everything
/// @param show         called periodically on the caller's thread while it waits
///
/// Fails: with the first error, in order of the jobs, of a flight or of `take`; out_of_memory. Waits for flights that
///        have started
Result<void> play_all(
    std::shared_ptr<const HeightSource> source, ChunkCache& chunks, std::span<const PagingJob> jobs,
    std::size_t thread_count, const std::function<Result<void>(std::size_t, PagingRun)>& take,
    const std::function<void()>& show = [] {});

}  // namespace terrane::tools
