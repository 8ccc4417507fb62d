// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/pager.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

namespace terrane::tools {

/// Values of --policy.
enum class PagingChoice {
    deadline,  ///< PagingPolicy::deadline
    distance,  ///< PagingPolicy::distance
    oracle,    ///< PagingPolicy::deadline with the true trajectories of cameras and bodies
};

/// The values of --policy, in the order of PagingChoice.
std::vector<std::string> paging_choice_names();
const char* name_of(PagingChoice choice);
PagingPolicy pager_policy(PagingChoice choice);

/// A least-recently-used cache of the chunks of one terrain, shared by many flights over it.
///
/// Threads: any number at once. Two threads that request the same absent chunk may both build it; the results are
///          equal.
class ChunkCache {
public:
    ChunkCache(std::shared_ptr<const HeightSource> source, std::size_t most_bytes);

    /// Returns the chunk as make_chunk() does. Failures are not cached.
    Result<std::shared_ptr<const Chunk>> get(const ChunkKey& key);

private:
    struct Entry {
        std::shared_ptr<const Chunk> chunk;
        std::list<ChunkKey>::iterator turn;
    };

    std::shared_ptr<const Chunk> find(const ChunkKey& key);
    void keep(std::shared_ptr<const Chunk> chunk);

    std::shared_ptr<const HeightSource> source_;
    std::size_t most_bytes_;
    std::mutex mutex_;
    std::unordered_map<ChunkKey, Entry, ChunkKeyHash> entries_;
    std::list<ChunkKey> turns_;  // by last use, most recent at the end
    std::size_t bytes_ = 0;
};

/// A pipe whose bandwidth all active transfers share equally. The caller passes the time in seconds, which must not
/// decrease. Threads: one at a time.
class FairPipe {
public:
    /// @param bandwidth bytes/s, > 0
    explicit FairPipe(double bandwidth) : bandwidth_(bandwidth) {}

    /// Begins a transfer; returns its id.
    double begin(double now, double bytes);
    bool is_done(double now, double transfer);
    /// Time at which the first of the active transfers ends unless another one begins. Requires an active transfer.
    double next_end() const;
    /// Changes the bandwidth of what is left of the active transfers, and of later ones.
    void set_bandwidth(double now, double bandwidth);

private:
    void advance(double now);

    double bandwidth_;
    double time_ = 0.0;
    double share_ = 0.0;  // bytes that a transfer active since the start would have received
    std::multiset<double> ends_;  // values of share_ at which the active transfers end
};

/// How fast storage answers; by default at once.
struct StorageSpeed {
    double latency = 0.0;  ///< seconds from a request to its first byte, >= 0
    double bandwidth = std::numeric_limits<double>::infinity();  ///< bytes/s, > 0

    bool is_limited() const {
        return latency > 0.0 || bandwidth < std::numeric_limits<double>::infinity();
    }
};

/// Simulates slow storage in real time: sample() and stored_chunk() wait for a latency and then for the transfer of a
/// whole chunk through a pipe that all threads share equally. make_chunk() calls sample() once. Nothing else waits.
class SlowHeights final : public ForwardedHeights {
public:
    /// Storage is fast until set_speed().
    explicit SlowHeights(std::shared_ptr<const HeightSource> source);

    /// Changes the speed at once, also for requests that wait. Threads: any.
    void set_speed(const StorageSpeed& speed);
    /// Threads: any.
    StorageSpeed speed() const;

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;

private:
    void wait_for_storage() const;

    std::atomic<bool> is_slow_{false};
    mutable std::mutex mutex_;
    StorageSpeed speed_;
    mutable std::condition_variable changed_;
    mutable FairPipe pipe_;
};

}  // namespace terrane::tools
