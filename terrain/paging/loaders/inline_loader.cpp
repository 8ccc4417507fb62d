// SPDX-License-Identifier: MIT
#include "paging/loaders/inline_loader.h"

#include "paging/loaders/claimed_load.h"

#include <utility>

namespace terrane::internal {

void InlineLoader::queue(std::vector<LoadRequest> requests) {
    for (LoadRequest& request : requests) {
        const ChunkKey key = request.key;
        FinishedLoad load{key, load_claimed(key, std::move(request.claim),
                                            [&] { return make_chunk(*source_, key); })};
        if (load.chunk) load.bytes_read = (*load.chunk)->bytes();
        finished_.push_back(std::move(load));
    }
}

}  // namespace terrane::internal
