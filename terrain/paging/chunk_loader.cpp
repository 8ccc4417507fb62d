// SPDX-License-Identifier: MIT
#include "paging/chunk_loader.h"

#include <terrane/base/result.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/chunk_source.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace terrane {

ByteClaim::ByteClaim(std::shared_ptr<ByteCount> count, std::size_t bytes)
    : count_(std::move(count)), bytes_(bytes) {
    TERRANE_ASSERT(count_, "a claim needs a count");
    count_->fetch_add(bytes_);
}

ByteClaim::ByteClaim(ByteClaim&& other) noexcept
    : count_(std::move(other.count_)), bytes_(std::exchange(other.bytes_, 0)) {}

ByteClaim& ByteClaim::operator=(ByteClaim&& other) noexcept {
    ByteClaim taken(std::move(other));
    std::swap(count_, taken.count_);
    std::swap(bytes_, taken.bytes_);
    return *this;
}

ByteClaim::~ByteClaim() { shrink(0); }

void ByteClaim::shrink(std::size_t bytes) {
    TERRANE_ASSERT(bytes <= bytes_, "a claim does not grow");
    if (count_) count_->fetch_sub(bytes_ - bytes);
    bytes_ = bytes;
}

std::shared_ptr<const Chunk> claimed(std::shared_ptr<const Chunk> chunk, ByteClaim claim) {
    TERRANE_ASSERT(chunk, "a claim is of a chunk");
    struct Held {
        ByteClaim claim;  // first member, so destroyed last: released after the chunk
        std::shared_ptr<const Chunk> chunk;
    };
    claim.shrink(std::min(claim.bytes(), chunk->bytes()));
    const auto held = std::make_shared<Held>();
    held->claim = std::move(claim);
    held->chunk = std::move(chunk);
    return {held, held->chunk.get()};
}

FinishedLoad run_load(const HeightSource& source, LoadRequest request,
                      const std::stop_token& stop) noexcept {
    const ChunkKey key = request.key;
    FinishedLoad load{key, internal::load_claimed(key, std::move(request.claim),
                                                  [&] { return make_chunk(source, key, stop); })};
    if (load.chunk) load.bytes_read = (*load.chunk)->bytes();
    return load;
}

}  // namespace terrane

namespace terrane::internal {

void InlineLoader::queue(std::vector<LoadRequest> requests) {
    std::vector<ChunkKey> keys;
    for (const LoadRequest& request : requests) keys.push_back(request.key);
    for (std::size_t i = 0; i < requests.size(); ++i) {
        // Again for each load: once the index of a shard is read, more of its records are known.
        chunks_of(*source_).expect_chunks(std::span(keys).subspan(i));
        finished_.push_back(run_load(*source_, std::move(requests[i])));
    }
}

}  // namespace terrane::internal
