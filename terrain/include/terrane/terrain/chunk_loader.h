// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

namespace terrane {

/// Bytes accounted to chunks: the actual size of each live chunk, and ChunkSource::max_chunk_bytes() for each
/// requested one.
using ByteCount = std::atomic<std::size_t>;

/// Bytes added to a byte count, and subtracted when the claim is destroyed, on any thread (RAII). Threads: one at a
/// time per claim; any number of claims may share a count.
class ByteClaim {
public:
    ByteClaim() = default;
    /// Adds bytes to the count. The caller checks the ceiling.
    ByteClaim(std::shared_ptr<ByteCount> count, std::size_t bytes);
    ByteClaim(ByteClaim&& other) noexcept;
    ByteClaim& operator=(ByteClaim&& other) noexcept;
    ~ByteClaim();

    /// Claimed bytes.
    std::size_t bytes() const { return bytes_; }
    /// Releases all but `bytes`. Requires bytes <= bytes().
    void shrink(std::size_t bytes);

private:
    std::shared_ptr<ByteCount> count_;
    std::size_t bytes_ = 0;
};

/// A chunk to load, and its claim of ChunkSource::max_chunk_bytes().
struct LoadRequest {
    ChunkKey key;     ///< of the chunk
    ByteClaim claim;  ///< bytes of the ceiling, held until the load ends
};

/// The result of a request.
struct FinishedLoad {
    ChunkKey key;  ///< of the chunk
    /// The chunk, which owns its claim. Fails as make_chunk(), and with
    ///   cancelled      cancel() was called
    ///   timed_out      the storage did not answer; the hanging load may still hold the claim
    ///   out_of_memory  memory is exhausted, or the chunk is larger than its claim
    ///   io             the source threw an exception
    /// After any error but timed_out the claim has been released.
    Result<std::shared_ptr<const Chunk>> chunk;
    double seconds = 0.0;        ///< duration on the loader's clock
    std::size_t bytes_read = 0;  ///< transferred from storage, if known; also for cancelled loads
};

/// Interface through which a pager loads chunks. Implementations: ThreadLoader for simulators; VirtualLoader, with
/// simulated storage on a virtual clock, for experiments.
///
/// Each load is queued, started, finished and taken, in this order. Started loads can be cancelled; queued loads can be
/// taken back. Only wait() blocks. The destructor cancels all loads.
///
/// Threads: one, the owner's.
class ChunkLoader {
public:
    virtual ~ChunkLoader() = default;

    /// Sets the time of the pager's clock, seconds. Ignored if the time is earlier than before, or not finite.
    virtual void advance(double time_s) = 0;

    /// Takes back all loads that have not started. No load starts before the next queue().
    virtual std::vector<LoadRequest> take_queue() = 0;
    /// Queues loads in order of priority. Requires an empty queue, and no key whose load was started and has not been
    /// taken.
    virtual void queue(std::vector<LoadRequest> requests) = 0;
    /// Cancels a started load: it finishes soon with `cancelled`, unless it has already finished or timed out. Ignores
    /// other loads and unknown keys.
    virtual void cancel(const ChunkKey& key) = 0;
    /// Returns the loads that finished since the last call, ordered by key.
    virtual std::vector<FinishedLoad> take_finished() = 0;

    /// Largest number of loads in progress at once, at least 1.
    virtual int slots() const = 0;
    /// Blocks until a load has finished or timed out, or no load can finish any more, because none is queued or started
    /// or all slots hang. A virtual clock advances to that time; advance() to an earlier time is then ignored.
    virtual void wait() = 0;
};

/// Runs one load, for custom loaders: makes the chunk, and attaches or releases its claim.
///
/// @param stop on request, the load soon fails with `cancelled`
///
/// Fails:   in FinishedLoad::chunk, as described there, except for timed_out
/// Returns: a load whose bytes_read is the chunk's size; `seconds` is 0, for the loader to fill in
/// Threads: any number at once
FinishedLoad run_load(const HeightSource& source, LoadRequest request,
                      const std::stop_token& stop = {}) noexcept;

/// Attaches a claim to a chunk. The claim is shrunk to the chunk's size if it is larger, and released when the last
/// owner of the chunk releases it.
std::shared_ptr<const Chunk> claimed(std::shared_ptr<const Chunk> chunk, ByteClaim claim);

/// Settings of a ThreadLoader. Fixed once it is created.
struct ThreadLoaderSettings {
    int worker_count = 1;  ///< 1 to 256
    /// Seconds after which a load times out and its thread is replaced, > 0; clamped to 1e9.
    double timeout = 30.0;
};

/// Loads chunks from a source on its own threads, timed by the steady clock; advance() does nothing.
///
/// A hanging read blocks its thread. After the timeout, its load is reported as timed_out and a new thread replaces the
/// blocked one. At most worker_count hanging threads are replaced; after that, loads wait. When the read of a replaced
/// thread returns, the thread releases its claim, ends, and no longer counts towards this limit. take_finished() and
/// wait() check timeouts and replace threads; a load that has finished by then has not timed out. If the system cannot
/// start a thread, the remaining ones continue.
///
/// The destructor cancels loads in progress and waits at most one second for them. A thread that hangs longer is
/// detached and keeps the source alive. The destructor does not wait for replaced threads.
///
/// FinishedLoad::bytes_read is the chunk's size if it was made, even if cancelled, else 0.
class ThreadLoader final : public ChunkLoader {
public:
    /// Fails: invalid_argument for a setting out of its range; out_of_memory if a thread cannot be started
    static Result<std::unique_ptr<ThreadLoader>> create(std::shared_ptr<const HeightSource> source,
                                                        const ThreadLoaderSettings& settings);
    ~ThreadLoader() override;

    void advance(double time_s) override;
    std::vector<LoadRequest> take_queue() override;
    void queue(std::vector<LoadRequest> requests) override;
    void cancel(const ChunkKey& key) override;
    std::vector<FinishedLoad> take_finished() override;
    int slots() const override;
    void wait() override;

private:
    struct State;
    explicit ThreadLoader(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;  // shared with the threads
};

/// A model of storage. Times in seconds, at most 1e9.
struct VirtualStorage {
    double latency = 0.02;        ///< median time L from a request to its first byte, >= 0
    double latency_spread = 0.0;  ///< latency L * 2^(spread * s), s uniform in [-1, 1); 0 to 16
    double bandwidth = 100e6;     ///< bytes a second, shared evenly by all transfers, >= 1
    int slots = 8;                ///< most requests in flight, 1 to 1024
    double failure_share = 0.0;   ///< share of requests that fail after their latency, 0 to 1
    double hang_share = 0.0;      ///< share of requests that hang, 0 to 1 - failure_share
    double timeout = 30.0;        ///< after which a hanging request times out, > 0
    std::uint64_t seed = 1;  ///< of latencies, failures and hangs, drawn whenever a load starts
};

/// Loads chunks from simulated storage on a virtual clock: the same calls yield the same chunks at the same times on
/// every machine, whatever the step size of advance(). The chunk of a load is made when the load finishes, on the
/// caller's thread, in advance() or wait(). Each load transfers Chunk::max_bytes(); for a cancelled load, the bytes
/// transferred so far are counted.
///
/// The clock starts at 0 s. Requests start in queue order as slots become free.
class VirtualLoader final : public ChunkLoader {
public:
    /// Makes the chunk of a key.
    using MakeChunk = std::function<Result<std::shared_ptr<const Chunk>>(const ChunkKey&)>;

    /// @param make makes the chunk of a load, such as make_chunk() behind a cache; must not return null. Its exceptions
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
