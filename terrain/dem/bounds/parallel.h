// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace terrane::internal {

/// Calls work(i) for 0 <= i < count from several threads, in any order, until one fails.
///
/// @param work  returns Result<void>
/// @return the last failure
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
