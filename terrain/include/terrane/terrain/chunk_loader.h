// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

namespace terrane {

/// Bytes that chunks take: of each that lives, and Chunk::max_bytes() for each that is asked for.
using ByteCount = std::atomic<std::size_t>;

/// A share of a byte count, given back when the claim goes: once, on whichever thread that is. Threads:
/// one at a time for each claim, any number for their count.
class ByteClaim {
public:
    ByteClaim() = default;
    /// Adds so many bytes to the count; whether there is room is the caller's question.
    ByteClaim(std::shared_ptr<ByteCount> count, std::size_t bytes);
    ByteClaim(ByteClaim&& other) noexcept;
    ByteClaim& operator=(ByteClaim&& other) noexcept;
    ~ByteClaim();

    std::size_t bytes() const { return bytes_; }
    /// Gives back all but so many bytes. Requires bytes <= bytes().
    void shrink(std::size_t bytes);

private:
    std::shared_ptr<ByteCount> count_;
    std::size_t bytes_ = 0;
};

/// A chunk that is to be loaded, and the room that was made for it: Chunk::max_bytes().
struct LoadRequest {
    ChunkKey key;
    ByteClaim claim;
};

/// What came of a request.
struct FinishedLoad {
    ChunkKey key;
    /// Its bytes are claimed until the last holder lets go of it. Errors are those of make_chunk(), and
    ///   cancelled      it was given up
    ///   timed_out      the storage did not answer; it may still hold its claim
    ///   out_of_memory  there was none
    ///   io             the source threw something
    /// With an error, but for timed_out, the claim has been given back.
    Result<std::shared_ptr<const Chunk>> chunk;
    double seconds = 0.0;        ///< from its beginning to its end, by the loader's clock
    std::size_t bytes_read = 0;  ///< that it moved from storage as far as is known, given up or not
};

/// Where a pager has its chunks loaded: threads in a simulator (thread_loader.h), storage on a virtual
/// clock in an experiment (virtual_loader.h).
///
/// A load is queued, then begun, then finished; it is taken once. Only begun loads can be cancelled:
/// what is queued is taken back. No call waits for a load, but wait(). The destructor gives up all of
/// them.
///
/// Threads: one owner calls everything.
class ChunkLoader {
public:
    virtual ~ChunkLoader() = default;

    /// Tells the time of the pager's clock, seconds. Less than before, or not finite: ignored.
    virtual void advance(double time_s) = 0;

    /// Takes back everything that was not begun: no load begins before queue() is called again.
    virtual std::vector<LoadRequest> take_queue() = 0;
    /// What to load next, the first one first. Requires an empty queue, and keys of which no load has
    /// begun that is not taken.
    virtual void queue(std::vector<LoadRequest> requests) = 0;
    /// Gives up a load that has begun and is not taken; it is finished soon, and says `cancelled`
    /// unless it was done already, or `timed_out`. Others are left alone, and keys that are not known.
    virtual void cancel(const ChunkKey& key) = 0;
    /// Moves out what was finished since the last call, in order of keys.
    virtual std::vector<FinishedLoad> take_finished() = 0;

    /// Loads that may be under way at once, at least 1.
    virtual int slots() const = 0;
    /// Waits until something is finished, timed out included, or nothing can be: nothing is queued or
    /// begun, or storage hangs so that nothing queued can begin. On a virtual clock: goes on to that
    /// moment; times before it that are told later are ignored.
    virtual void wait() = 0;
};

/// A chunk that keeps its claim, shrunk to its own bytes, until the last holder lets go of it. A claim of
/// less stays as it is.
std::shared_ptr<const Chunk> claimed(std::shared_ptr<const Chunk> chunk, ByteClaim claim);

}  // namespace terrane
