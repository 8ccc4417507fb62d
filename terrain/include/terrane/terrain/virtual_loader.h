// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <cstdint>
#include <functional>
#include <memory>

namespace terrane {

/// Storage as an experiment imagines it. Times in seconds, at most 1e9.
struct VirtualStorage {
    double latency = 0.02;        ///< from a request to its first byte, median, >= 0
    double latency_spread = 0.0;  ///< each takes latency * 2^(spread * s), s from -1 to 1; 0 to 16
    double bandwidth = 100e6;     ///< bytes a second, shared evenly by all past their latency, >= 1
    int slots = 8;                ///< requests at once, 1 to 1024
    double failure_share = 0.0;   ///< of requests that end in an error after their latency, 0 to 1
    double hang_share = 0.0;      ///< of requests that never end; with failure_share at most 1
    double timeout = 30.0;        ///< after which a request that hangs is given up, > 0
    std::uint64_t seed = 1;       ///< of spread, failures and hangs, anew each time a key is begun
};

/// Loads chunks from storage that exists on a virtual clock only: the same calls give the same chunks
/// at the same times on every machine, in however many steps advance() goes from one to the next. What
/// a load brings is made at once when it is finished, in the caller's thread: in advance() or wait(). A
/// chunk counts Chunk::max_bytes() on its way; a load that is given up, what it had of them.
///
/// Its clock begins at 0 s. A request begins when it is queued and a slot is free, or at the moment when
/// one becomes free; the first in the queue first.
class VirtualLoader final : public ChunkLoader {
public:
    using MakeChunk = std::function<Result<std::shared_ptr<const Chunk>>(const ChunkKey&)>;

    /// @param make what a load brings, such as make_chunk() behind a cache; never null. What it throws
    ///             becomes an error of the load
    ///
    /// Fails with invalid_argument for a value out of its range.
    static Result<std::unique_ptr<VirtualLoader>> create(const VirtualStorage& storage,
                                                         MakeChunk make);
    ~VirtualLoader() override;

    void advance(double time_s) override;
    std::vector<LoadRequest> take_queue() override;
    void queue(std::vector<LoadRequest> requests) override;
    void cancel(const ChunkKey& key) override;
    std::vector<FinishedLoad> take_finished() override;
    int slots() const override;
    void wait() override;

private:
    struct State;
    explicit VirtualLoader(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
