// SPDX-License-Identifier: MIT
#include "paging/loaders/inline_loader.h"

#include <utility>

namespace terrane::internal {

void InlineLoader::queue(std::vector<LoadRequest> requests) {
    for (LoadRequest& request : requests) {
        finished_.push_back(run_load(*source_, std::move(request)));
    }
}

}  // namespace terrane::internal
