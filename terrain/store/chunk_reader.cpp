// SPDX-License-Identifier: MIT
#include "chunk_reader.h"

#include "format/chunk_codec.h"

#include <algorithm>
#include <string>
#include <vector>

namespace terrane::internal {

Result<std::shared_ptr<const Chunk>> ChunkReader::read(const ChunkKey& key) const {
    const auto damaged = [&] {
        return fail(ErrorCode::bad_data, "\"" + file_.path() + "\": chunk " +
                                             std::to_string(key.x) + ", " + std::to_string(key.y) +
                                             " of level " + std::to_string(key.level) +
                                             " is damaged");
    };
    const ChunkRecord& record = directory_.chunks[directory_.index_of(key)];
    // At most the longest record: the directory is not trusted.
    if (record.bytes > 2 * max_encoded_bytes()) return damaged();
    std::vector<std::uint8_t> stored(record.bytes);
    if (auto done = file_.read(record.offset, stored); !done) return tl::unexpected(done.error());
    std::vector<std::uint8_t> content(max_encoded_bytes());
    const Result<std::size_t> size = decompress(stored, content);
    if (!size) return damaged();
    content.resize(*size);
    if (hash_of(content) != record.hash) return damaged();
    auto chunk = decode_chunk(content, directory_.lattice, key);
    if (!chunk) return damaged();
    return chunk;
}

Result<std::shared_ptr<const Chunk>> ChunkReader::find(const ChunkKey& key) const {
    {
        const std::lock_guard lock(mutex_);
        for (CachedChunk& cached : cache_) {
            if (cached.chunk == nullptr || cached.chunk->key != key) continue;
            cached.used = ++clock_;
            return cached.chunk;
        }
    }
    auto chunk = read(key);
    if (!chunk) return chunk;
    const std::lock_guard lock(mutex_);
    CachedChunk& oldest = *std::ranges::min_element(cache_, {}, &CachedChunk::used);
    oldest = {*chunk, ++clock_};
    return chunk;
}

}  // namespace terrane::internal
