// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

namespace terrane::tools {

/// Chunks of one terrain, made once and kept while there is room, so that many flights over it do not
/// make them again. Those that were asked for longest ago go first.
///
/// Threads: any number at once. Two that ask for the same chunk at the same time may both make it: it
/// is the same.
class ChunkCache {
public:
    ChunkCache(std::shared_ptr<const HeightSource> source, std::size_t most_bytes);

    /// As make_chunk(). What fails is not kept.
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
    std::list<ChunkKey> turns_;  // the one that was asked for last is the last one
    std::size_t bytes_ = 0;
};

}  // namespace terrane::tools
