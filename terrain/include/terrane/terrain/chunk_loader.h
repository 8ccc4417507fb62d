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

/// Bytes of chunks: those of each live chunk, and HeightSource::max_chunk_bytes() for each requested one.
using ByteCount = std::atomic<std::size_t>;

/// A share of a byte count that is released when the claim is destroyed, on any thread. Threads: one at a time for each
/// claim, any number for their count.
class ByteClaim {
public:
    ByteClaim() = default;
    /// Adds bytes to the count; the caller checks the ceiling.
    ByteClaim(std::shared_ptr<ByteCount> count, std::size_t bytes);
    ByteClaim(ByteClaim&& other) noexcept;
    ByteClaim& operator=(ByteClaim&& other) noexcept;
    ~ByteClaim();

    /// Bytes that are claimed.
    std::size_t bytes() const { return bytes_; }
    /// Releases all but `bytes`. Requires bytes <= bytes().
    void shrink(std::size_t bytes);

private:
    std::shared_ptr<ByteCount> count_;
    std::size_t bytes_ = 0;
};

/// A chunk to load, and its claim of HeightSource::max_chunk_bytes().
struct LoadRequest {
    ChunkKey key;     ///< of the chunk
    ByteClaim claim;  ///< bytes of the ceiling, held until the load ends
};

/// The result of a request.
struct FinishedLoad {
    ChunkKey key;  ///< of the chunk
    /// The chunk owns its claim. Errors are those of make_chunk(), and
    ///   cancelled      by cancel()
    ///   timed_out      the storage did not answer; it may still hold the claim
    ///   out_of_memory  memory is exhausted, or the chunk is larger than its claim
    ///   io             the source threw an exception
    /// With an error other than timed_out the claim has been released.
    Result<std::shared_ptr<const Chunk>> chunk;
    double seconds = 0.0;        ///< duration, by the loader's clock
    std::size_t bytes_read = 0;  ///< moved from storage, as far as known; also of cancelled loads
};

/// Loads chunks for a pager: on threads in a simulator (chunk_loader.h), from storage on a virtual clock in an
/// experiment (chunk_loader.h).
///
/// A load is queued, begun, finished and taken, once each. Begun loads can be cancelled; queued ones are taken back. No
/// call but wait() blocks. The destructor cancels all loads.
///
/// Threads: one owner calls everything.
class ChunkLoader {
public:
    virtual ~ChunkLoader() = default;

    /// Sets the time of the pager's clock, seconds. Ignored if less than before or not finite.
    virtual void advance(double time_s) = 0;

    /// Takes back all loads that have not begun. No load begins before the next queue().
    virtual std::vector<LoadRequest> take_queue() = 0;
    /// Queues loads in order of priority. Requires an empty queue, and keys without a load that has begun and is not
    /// taken.
    virtual void queue(std::vector<LoadRequest> requests) = 0;
    /// Cancels a load that has begun: it finishes soon with `cancelled`, unless it was finished already or timed out.
    /// Ignores other loads and unknown keys.
    virtual void cancel(const ChunkKey& key) = 0;
    /// Returns the loads finished since the last call, in order of keys.
    virtual std::vector<FinishedLoad> take_finished() = 0;

    /// Largest number of loads in progress at once, at least 1.
    virtual int slots() const = 0;
    /// Blocks until a load is finished (or timed out), or none can be: nothing is queued or begun, or all slots hang
    /// so that nothing queued can begin. On a virtual clock: advances to that time; earlier times set later are
    /// ignored.
    virtual void wait() = 0;
};

/// Runs one load, for loaders of one's own: makes the chunk, and attaches its claim or releases it.
///
/// @param stop makes a load fail with `cancelled` soon
///
/// Fails:   in FinishedLoad::chunk, as described there, but for timed_out
/// Returns: `seconds` is 0, for the loader to fill in; bytes_read are those of the chunk
/// Threads: any number at once
FinishedLoad run_load(const HeightSource& source, LoadRequest request,
                      const std::stop_token& stop = {}) noexcept;

/// Attaches a claim to a chunk, shrunk to the chunk's bytes (a smaller one is kept): released with the last owner.
std::shared_ptr<const Chunk> claimed(std::shared_ptr<const Chunk> chunk, ByteClaim claim);

/// Settings of a ThreadLoader. Fixed once it is created.
struct ThreadLoaderSettings {
    int worker_count = 1;  ///< 1 to 256
    /// Seconds after which a load times out and its thread is replaced, > 0; clamped to 1e9.
    double timeout = 30.0;
};

/// Loads chunks from a source on threads of its own, timed by the steady clock; advance() does nothing.
///
/// Storage that hangs blocks a thread. After the timeout its load is reported as timed_out and a new thread replaces
/// it; at most worker_count hanging threads are replaced, then loads wait. A replaced thread that returns releases its
/// claim and ends, and no longer counts. Timeouts are checked, and threads replaced, in take_finished() and
/// wait(): a load that is finished by then is not late. If the system has no thread left, the remaining ones go on.
///
/// The destructor cancels loads in progress and waits for them for a second at most; a thread that hangs longer is
/// detached and keeps the source alive. Threads replaced before are not waited for.
///
/// FinishedLoad::bytes_read is the chunk's own bytes if it was made, cancelled or not, else 0.
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
