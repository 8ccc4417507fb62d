// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "frames/frame_maker.h"
#include "source/paging_choice.h"
#include "source/chunk_cache.h"
#include "camera/camera_path.h"

#include <terrane/terrain/virtual_loader.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane::tools {

struct PagingRunSettings {
    PagingChoice policy = PagingChoice::deadline;
    FrameMakerSettings maker;  ///< but for the pager's policy
    VirtualStorage storage;
    View view;  ///< from no place yet
    double fps = 30.0;
    std::size_t frame_count = 1;
    std::size_t body_count = 0;
    double announce = 0.0;  ///< seconds ahead that jumps are told
    std::atomic<std::size_t>* frames_done =
        nullptr;  ///< counts frames of all flights; null for nothing
};

/// What a flight over simulated storage came to. Bytes and counts are those of the flight, not of
/// what was loaded before it.
struct PagingTotals {
    std::size_t frames = 0;
    std::size_t late_frames = 0;     ///< FrameRecord::is_late()
    double excess_error_px_s = 0.0;  ///< of these
    double error_px_max = 0.0;
    std::uint64_t bytes_loaded = 0;  ///< moved from storage
    std::uint64_t bytes_wasted = 0;  ///< ... and needed by nobody until the flight's end
    std::size_t peak_bytes = 0;      ///< resident and in flight together, since creation
    std::size_t contact_late = 0;    ///< body frames without ground under the body
    std::size_t body_frames = 0;
    std::uint64_t loaded = 0;  ///< the same below as in PagerStats
    std::uint64_t reloads = 0;
    std::uint64_t evicted = 0;
    std::uint64_t hard_evictions = 0;
    std::uint64_t cancelled = 0;
    std::uint64_t failed = 0;
    std::uint64_t timed_out = 0;
    std::uint64_t over_ceiling = 0;

    double late_share() const;
    double wasted_share() const;
};

/// The same on every machine, but for FrameRecord::update_ms.
struct PagingRun {
    PagingTotals totals;
    std::vector<FrameRecord> frames;
    std::vector<std::size_t> contact_late;  ///< [frames] bodies without ground under them
};

/// Plays a path against storage on a virtual clock: frame i is the moment i / fps. What the first frame
/// needs is loaded before the clock starts.
///
/// @param source also that of the chunks
///
/// Fails: what Pager, Triangulator and VirtualLoader say of their settings; io where the storage never
///        gives the root squares; cancelled where is_interrupted()
Result<PagingRun> run_paging(std::shared_ptr<const HeightSource> source, ChunkCache& chunks,
                             const CameraPath& path, const PagingRunSettings& settings);

/// One flight of many over the same terrain.
struct PagingJob {
    const CameraPath* path = nullptr;
    PagingRunSettings settings;
};

/// Plays flights on several threads at once, and hands on what they came to: in their order, on the
/// caller's thread, each as soon as all before it are there.
///
/// @param thread_count >= 1
/// @param take         is given the number of a job and its run; an error ends it all
/// @param show         called on the caller's thread now and then while it waits
///
/// Fails: with the first error, in their order, of a flight or of `take`; out_of_memory. Flights that
///        have begun are waited for
Result<void> play_all(
    std::shared_ptr<const HeightSource> source, ChunkCache& chunks, std::span<const PagingJob> jobs,
    std::size_t thread_count, const std::function<Result<void>(std::size_t, PagingRun)>& take,
    const std::function<void()>& show = [] {});

}  // namespace terrane::tools
