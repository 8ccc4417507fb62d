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

/// Reads a chunk, and keeps what lives counted: every byte of it leaves `live_bytes` when the last
/// holder lets go of the chunk.
Result<std::shared_ptr<const Chunk>> load_counted(
    const HeightSource& source, const ChunkKey& key,
    std::shared_ptr<std::atomic<std::size_t>> live_bytes);

/// Threads that read chunks, the first in the queue first.
///
/// Threads: one owner calls everything; the destructor waits for the chunks that are being read.
class Loader {
public:
    Loader(std::shared_ptr<const HeightSource> source,
           std::shared_ptr<std::atomic<std::size_t>> live_bytes, int worker_count);
    ~Loader();

    /// Replaces everything that has not been begun. Returns how many of the old ones were not begun
    /// and are not among the new.
    std::size_t replace_queue(std::vector<ChunkKey> keys);

    /// Moves out what was finished since the last call, in order of keys.
    std::vector<Loaded> take_finished();

    /// Chunks being read now, and those finished but not taken.
    std::vector<ChunkKey> begun() const;

    /// Waits until something is finished, or nothing is queued or being read.
    void wait();

private:
    void work(const std::stop_token& stop);

    std::shared_ptr<const HeightSource> source_;
    std::shared_ptr<std::atomic<std::size_t>> live_bytes_;
    mutable std::mutex mutex_;
    std::condition_variable_any queued_;
    std::condition_variable_any changed_;
    std::vector<ChunkKey> queue_;  // last one first
    std::vector<ChunkKey> reading_;
    std::vector<Loaded> finished_;
    std::vector<std::jthread> workers_;  // last: joined first
};

}  // namespace terrane::internal
