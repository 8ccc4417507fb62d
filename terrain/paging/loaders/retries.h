// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_key.h>

#include <algorithm>
#include <map>

namespace terrane::internal {

/// Exponential back-off of failed loads: retried after 0.1 s, then after twice as long each time, at most 10 s.
class Retries {
public:
    void failed(const ChunkKey& key, double time_s) {
        Failure& failure = failures_[key];
        constexpr double kFirst_s = 0.1;
        constexpr double kLast_s = 10.0;
        constexpr int kMostDoublings = 10;
        failure.retry_s =
            time_s + std::min(kLast_s, kFirst_s * (1 << std::min(failure.count, kMostDoublings)));
        ++failure.count;
    }
    void succeeded(const ChunkKey& key) { failures_.erase(key); }

    bool must_wait(const ChunkKey& key, double time_s) const {
        const auto found = failures_.find(key);
        return found != failures_.end() && time_s < found->second.retry_s;
    }
    /// Consecutive failures.
    int count(const ChunkKey& key) const {
        const auto found = failures_.find(key);
        return found == failures_.end() ? 0 : found->second.count;
    }

private:
    struct Failure {
        int count = 0;
        double retry_s = 0.0;
    };
    std::map<ChunkKey, Failure> failures_;
};

}  // namespace terrane::internal
