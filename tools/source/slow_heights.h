// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>

namespace terrane::tools {

/// A pipe whose bandwidth all transfers under way share evenly. Times are the caller's, seconds that do
/// not go back. Threads: one at a time.
class FairPipe {
public:
    /// @param bandwidth bytes a second, > 0
    explicit FairPipe(double bandwidth) : bandwidth_(bandwidth) {}

    /// Begins a transfer; returns what names it.
    double begin(double now, double bytes);
    bool is_done(double now, double transfer);
    /// When the next transfer ends, if no other begins before. Requires one under way.
    double next_end() const;

private:
    void advance(double now);

    double bandwidth_;
    double time_ = 0.0;
    double share_ = 0.0;  // bytes that a transfer from the beginning on would have got so far
    std::multiset<double> ends_;  // shares at which transfers end
};

/// A source behind slow storage, in real time: the samples of a chunk arrive after a latency and through
/// a pipe that all threads share evenly, as if they were the whole chunk. Everything else is answered
/// at once: it is sample() that make_chunk() calls once. A chunk that the source holds ready made arrives in
/// the same way.
class SlowHeights final : public HeightSource {
public:
    /// @param latency   seconds from a request to its first byte, >= 0
    /// @param bandwidth bytes a second, > 0; infinite for no limit
    SlowHeights(std::shared_ptr<const HeightSource> source, double latency, double bandwidth);

    /// From now on storage is slow; before, it is not. Threads: any.
    void begin() { is_slow_ = true; }

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;

private:
    void wait_for_storage() const;

    std::shared_ptr<const HeightSource> source_;
    double latency_;
    double bandwidth_;
    std::atomic<bool> is_slow_{false};
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    mutable FairPipe pipe_;
};

}  // namespace terrane::tools
