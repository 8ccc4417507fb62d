// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/forwarded_heights.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>

namespace terrane::tools {

/// A pipe whose bandwidth all active transfers share equally. The caller passes the time, seconds; it must not
/// decrease. Threads: one at a time.
class FairPipe {
public:
    /// @param bandwidth bytes/s, > 0
    explicit FairPipe(double bandwidth) : bandwidth_(bandwidth) {}

    /// Begins a transfer; returns its id.
    double begin(double now, double bytes);
    bool is_done(double now, double transfer);
    /// When the next transfer ends, if no other begins before. Requires an active transfer.
    double next_end() const;

private:
    void advance(double now);

    double bandwidth_;
    double time_ = 0.0;
    double share_ = 0.0;  // bytes that a transfer active since the start would have received
    std::multiset<double> ends_;  // values of share_ at which the active transfers end
};

/// Simulates slow storage in real time: sample() and stored_chunk() take a latency plus the transfer of a whole chunk
/// through a pipe that all threads share equally. make_chunk() calls sample() once. Everything else is immediate.
class SlowHeights final : public ForwardedHeights {
public:
    /// @param latency   seconds from a request to its first byte, >= 0
    /// @param bandwidth bytes/s, > 0; infinite: no limit
    SlowHeights(std::shared_ptr<const HeightSource> source, double latency, double bandwidth);

    /// Starts the simulation; before this call storage is fast. Threads: any.
    void begin() { is_slow_ = true; }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;

private:
    void wait_for_storage() const;

    double latency_;
    double bandwidth_;
    std::atomic<bool> is_slow_{false};
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    mutable FairPipe pipe_;
};

}  // namespace terrane::tools
