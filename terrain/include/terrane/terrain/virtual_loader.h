// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <cstdint>
#include <functional>
#include <memory>

namespace terrane {

/// A model of storage. Times in seconds, at most 1e9.
struct VirtualStorage {
    double latency = 0.02;        ///< median time from a request to its first byte, >= 0
    double latency_spread = 0.0;  ///< latency * 2^(spread * s), s uniform in [-1, 1); 0 to 16
    double bandwidth = 100e6;     ///< bytes a second, shared evenly by all past their latency, >= 1
    int slots = 8;                ///< requests at once, 1 to 1024
    double failure_share = 0.0;   ///< of requests that end in an error after their latency, 0 to 1
    double hang_share = 0.0;      ///< of requests that never end; with failure_share at most 1
    double timeout = 30.0;        ///< of requests that hang, > 0
    std::uint64_t seed = 1;       ///< of spread, failures and hangs, drawn each time a key is begun
};

/// Loads chunks from simulated storage on a virtual clock: the same calls give the same chunks at the same times on
/// every machine, whatever the step size of advance(). A load's chunk is made when the load finishes, in the caller's
/// thread, by advance() or wait(). Each load transfers Chunk::max_bytes(); a cancelled one counts the bytes transferred
/// so far.
///
/// The clock starts at 0 s. A request begins when a slot is free, in the order of the queue.
class VirtualLoader final : public ChunkLoader {
public:
    /// Makes the chunk of a key.
    using MakeChunk = std::function<Result<std::shared_ptr<const Chunk>>(const ChunkKey&)>;

    /// @param make makes a load's chunk, such as make_chunk() behind a cache; never returns null. Its exceptions
    ///             become errors of the load
    ///
    /// Fails: invalid_argument for a value out of its range
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
