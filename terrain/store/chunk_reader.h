// SPDX-License-Identifier: MIT
#pragma once

#include "format/store_directory.h"

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>

namespace terrane::internal {

/// Reads chunks of a store. Threads: any, at once.
class ChunkReader {
public:
    ChunkReader(SealedReader file, StoreDirectory directory)
        : file_(std::move(file)), directory_(std::move(directory)) {}

    const StoreDirectory& directory() const { return directory_; }

    /// Reads, checks and decodes a chunk, without locks.
    /// Fails: io; bad_data if it is damaged
    Result<std::shared_ptr<const Chunk>> read(const ChunkKey& key) const;
    /// The same through a small cache: for queries of single points.
    Result<std::shared_ptr<const Chunk>> find(const ChunkKey& key) const;

private:
    struct CachedChunk {
        std::shared_ptr<const Chunk> chunk;
        std::uint64_t used = 0;
    };

    SealedReader file_;
    StoreDirectory directory_;
    mutable std::mutex mutex_;  ///< of the cache
    mutable std::array<CachedChunk, 32> cache_;
    mutable std::uint64_t clock_ = 0;
};

}  // namespace terrane::internal
