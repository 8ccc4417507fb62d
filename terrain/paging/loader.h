// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace terrane::internal {

/// One chunk that was read, or why not.
struct Loaded {
    ChunkKey key;
    Result<std::shared_ptr<const Chunk>> chunk;
};

/// Bytes that chunks take: of each that lives, and Chunk::max_bytes() for each that is being read.
using ByteCount = std::atomic<std::size_t>;

/// Reads a chunk whose Chunk::max_bytes() were added to the count before. Its own bytes leave the
/// count when the last holder lets go of it.
Result<std::shared_ptr<const Chunk>> load_counted(const HeightSource& source, const ChunkKey& key,
                                                  std::shared_ptr<ByteCount> bytes);

/// Takes from the count what was added to it for a load, but for what the chunk takes itself.
void settle(ByteCount& bytes, const Result<std::shared_ptr<const Chunk>>& loaded);

/// Threads that read chunks, the first in the queue first.
///
/// Threads: one owner calls everything; the destructor waits for the chunks that are being read.
class Loader {
public:
    Loader(std::shared_ptr<const HeightSource> source, std::shared_ptr<ByteCount> bytes,
           int worker_count);
    ~Loader();

    /// Takes back everything that was not begun: no load begins before queue() is called again.
    std::vector<ChunkKey> clear_queue();

    /// What to read next, the first one first. Requires an empty queue.
    void queue(std::vector<ChunkKey> keys);

    /// How much is under way, seen at one moment.
    struct Load {
        std::size_t queued = 0;
        std::size_t reading = 0;
        std::size_t bytes = 0;  ///< the count, and what the queue will add to it
    };
    Load load() const;

    /// Moves out what was finished since the last call, in order of keys.
    std::vector<Loaded> take_finished();

    /// Chunks being read now, and those finished but not taken.
    std::vector<ChunkKey> begun() const;

    /// Waits until something is finished, or nothing is queued or being read.
    void wait();

private:
    void work(const std::stop_token& stop);

    std::shared_ptr<const HeightSource> source_;
    std::shared_ptr<ByteCount> bytes_;
    mutable std::mutex mutex_;
    std::condition_variable_any queued_;
    std::condition_variable_any changed_;
    std::vector<ChunkKey> queue_;  // the first one last
    std::vector<ChunkKey> reading_;
    std::vector<Loaded> finished_;
    std::vector<std::jthread> workers_;  // last: joined first
};

}  // namespace terrane::internal
