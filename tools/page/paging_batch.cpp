// SPDX-License-Identifier: MIT
#include "page/paging_batch.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {

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
    // last: its threads end before what they use goes
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
