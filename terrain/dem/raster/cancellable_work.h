// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace terrane::internal {

/// Runs calls with a timeout, one at a time, on a separate thread: reading a file can block for ever (a pipe, a dead
/// network mount) or loop for ever (a damaged file), and neither can be interrupted from outside.
///
/// A call that timed out continues on a detached thread, so it must own everything that it uses. From then on the
/// process exits without running destructors of static objects, because that thread may still use them; standard
/// streams are flushed, and the exit status is kept.
class GuardedCalls {
public:
    /// @param patience_s timeout of a call, seconds; infinity: none
    explicit GuardedCalls(double patience_s);
    /// Waits for the call in progress, unless it timed out.
    ~GuardedCalls();
    GuardedCalls(const GuardedCalls&) = delete;
    GuardedCalls& operator=(const GuardedCalls&) = delete;

    /// Runs a call and waits until it returns; rethrows its exceptions. Returns false if this or an earlier call timed
    /// out.
    ///
    /// Threads: any; waiting for other calls does not count towards the timeout
    bool run(std::function<void()> call);

    double patience_s() const { return patience_s_; }

private:
    struct Shared;

    double patience_s_;
    std::mutex turn_;
    std::shared_ptr<Shared> shared_;
    std::thread thread_;
};

/// Reports the progress of opening a raster to the caller, which may cancel it.
class OpeningProgress {
public:
    /// @param report  as DemSettings::progress; may be empty
    OpeningProgress(std::string path, std::function<bool(double)> report)
        : path_(std::move(path)), report_(std::move(report)) {}

    /// Starts a stage that consists of some steps and ends at a share of the whole opening, 0 to 1.
    void begin(double end, std::int64_t steps);

    /// Completes a step.
    ///
    /// Fails:   cancelled if the caller stops the opening
    /// Threads: any
    Result<void> step();

private:
    const std::string path_;
    const std::function<bool(double)> report_;
    std::mutex mutex_;
    double from_ = 0.0, to_ = 0.0;
    std::int64_t done_ = 0, steps_ = 1;
    bool cancelled_ = false;
};

/// Calls work(i) for 0 <= i < count from several threads, in any order, until one fails.
///
/// @param work returns Result<void>
/// @return the last failure, if any
template <typename Work>
Result<void> in_parallel(int count, Work&& work) {
    std::atomic<int> next{0};
    std::mutex mutex;
    std::optional<Error> error;
    const auto take = [&] {
        for (int i = next++; i < count; i = next++) {
            const Result<void> done = work(i);
            if (done) continue;
            next = count;
            const std::lock_guard lock(mutex);
            error = done.error();
        }
    };
    {
        std::vector<std::jthread> helpers;
        const int cores = static_cast<int>(std::min(std::thread::hardware_concurrency(), 8u));
        while (static_cast<int>(helpers.size()) + 1 < std::min(cores, count)) {
            helpers.emplace_back(take);
        }
        take();
    }
    if (error) return tl::unexpected(*error);
    return {};
}

}  // namespace terrane::internal
