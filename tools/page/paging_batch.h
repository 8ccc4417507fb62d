// SPDX-License-Identifier: MIT
#pragma once

#include "page/paging_run.h"

#include <functional>
#include <memory>
#include <span>

namespace terrane::tools {

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
