// SPDX-License-Identifier: MIT
#include "source/chunk_cache.h"

#include <utility>

namespace terrane::tools {

ChunkCache::ChunkCache(std::shared_ptr<const HeightSource> source, std::size_t most_bytes)
    : source_(std::move(source)), most_bytes_(most_bytes) {}

Result<std::shared_ptr<const Chunk>> ChunkCache::get(const ChunkKey& key) {
    if (std::shared_ptr<const Chunk> chunk = find(key)) return chunk;
    Result<std::shared_ptr<const Chunk>> made = make_chunk(*source_, key);
    if (made) keep(*made);
    return made;
}

std::shared_ptr<const Chunk> ChunkCache::find(const ChunkKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found == entries_.end()) return nullptr;
    turns_.splice(turns_.end(), turns_, found->second.turn);
    return found->second.chunk;
}

void ChunkCache::keep(std::shared_ptr<const Chunk> chunk) {
    const std::size_t bytes = chunk->bytes();
    const ChunkKey key = chunk->key;
    if (bytes > most_bytes_) return;
    const std::lock_guard lock(mutex_);
    if (entries_.contains(key)) return;
    while (bytes_ + bytes > most_bytes_) {
        const auto oldest = entries_.find(turns_.front());
        bytes_ -= oldest->second.chunk->bytes();
        entries_.erase(oldest);
        turns_.pop_front();
    }
    bytes_ += bytes;
    entries_.emplace(key, Entry{std::move(chunk), turns_.insert(turns_.end(), key)});
}

}  // namespace terrane::tools
