// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Name of a chunk in error messages, such as "chunk (3, -4) of level 5".
inline std::string name_of(const ChunkKey& key) {
    return "chunk (" + std::to_string(key.x) + ", " + std::to_string(key.y) + ") of level " +
           std::to_string(key.level);
}

/// Makes a chunk and attaches the claim to it; releases the claim on failure.
///
/// @param make returns a Result<std::shared_ptr<const Chunk>>, never null
///
/// Fails:  as make() does; out_of_memory if the chunk is larger than the claim or make() throws std::bad_alloc; io if
///         make() throws anything else
/// Throws: nothing
template <class Make>
Result<std::shared_ptr<const Chunk>> load_claimed(const ChunkKey& key, ByteClaim claim,
                                                  const Make& make) noexcept {
    try {
        try {
            TERRANE_TRY(std::shared_ptr<const Chunk> made, make());
            if (const std::size_t bytes = made->bytes(); bytes > claim.bytes()) {
                return fail(ErrorCode::out_of_memory,
                            name_of(key) + " has " + std::to_string(bytes) +
                                " bytes, more than the " + std::to_string(claim.bytes()) +
                                " that its load has claimed");
            }
            return claimed(std::move(made), std::move(claim));
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& trouble) {
            return fail(ErrorCode::io, name_of(key) + " cannot be read: " + trouble.what());
        } catch (...) {
            return fail(ErrorCode::io, name_of(key) + " cannot be read");
        }
    } catch (...) {
        // std::bad_alloc; the message fits the string's internal buffer
        return fail(ErrorCode::out_of_memory, "out of memory");
    }
}

/// Loads chunks synchronously in queue().
class InlineLoader final : public ChunkLoader {
public:
    explicit InlineLoader(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}

    void advance(double) override {}
    std::vector<LoadRequest> take_queue() override { return {}; }
    void queue(std::vector<LoadRequest> requests) override;
    void cancel(const ChunkKey&) override {}
    std::vector<FinishedLoad> take_finished() override { return std::exchange(finished_, {}); }
    int slots() const override { return 256; }
    void wait() override {}

private:
    std::shared_ptr<const HeightSource> source_;
    std::vector<FinishedLoad> finished_;
};

/// Running mean and deviation of load times by level.
class LoadTimes {
public:
    void add(int level, double seconds) {
        add_to(levels_[index(level)], seconds);
        add_to(all_, seconds);
    }

    /// Expected load time of a level, seconds: mean plus twice the mean deviation, weighted over about the last ten
    /// loads. Levels with fewer than four loads use the times of all levels.
    double expected_s(int level) const {
        const Times& own = levels_[index(level)];
        const Times& times = own.count >= kEnough ? own : all_;
        return times.count > 0 ? times.mean_s + 2.0 * times.deviation_s : kUnknown_s;
    }

private:
    struct Times {
        double mean_s = 0.0;
        double deviation_s = 0.0;
        int count = 0;
    };
    static constexpr double kShare = 0.1;  // weight of a new time
    static constexpr int kEnough = 4;
    static constexpr double kUnknown_s = 0.05;

    static std::size_t index(int level) { return static_cast<std::size_t>(level); }
    static void add_to(Times& times, double seconds) {
        const double off = std::abs(seconds - times.mean_s);
        if (times.count == 0) {
            times.mean_s = seconds;
        } else {
            times.mean_s += kShare * (seconds - times.mean_s);
            times.deviation_s += kShare * (off - times.deviation_s);
        }
        times.count = std::min(times.count + 1, kEnough);
    }

    std::array<Times, 32> levels_;
    Times all_;
};

/// Exponential back-off of failed loads: first retry after 0.1 s, then after twice the previous delay, at most 10 s.
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
    /// Number of consecutive failures.
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
