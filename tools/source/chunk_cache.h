// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

namespace terrane::tools {

/// A least-recently-used cache of the chunks of one terrain, shared by many flights over it.
///
/// Threads: any number at once. Two threads that request the same absent chunk may both make it; the results are equal.
class ChunkCache {
public:
    ChunkCache(std::shared_ptr<const HeightSource> source, std::size_t most_bytes);

    /// As make_chunk(). Failures are not cached.
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
    std::list<ChunkKey> turns_;  // by last use, the latest at the end
    std::size_t bytes_ = 0;
};

}  // namespace terrane::tools
