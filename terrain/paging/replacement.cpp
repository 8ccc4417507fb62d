// SPDX-License-Identifier: MIT
//
// Resident chunks that are swapped because their source has changed.
#include "paging/pager_state.h"

#include <utility>

namespace terrane {

using internal::ChunkTree;

bool Pager::State::replace(std::span<const std::shared_ptr<const Chunk>> chunks,
                           std::span<const ChunkKey> changed,
                           const std::function<void()>& switch_source) {
    std::vector<std::pair<ChunkTree::Index, std::shared_ptr<const Chunk>>> resident;
    std::size_t needed_bytes = 0;
    for (const auto& chunk : chunks) {
        const ChunkTree::Index index = tree.find(chunk->key);
        if (index == ChunkTree::kNone) continue;
        resident.emplace_back(index, chunk);
        needed_bytes += chunk->bytes();
    }
    ByteClaim all;
    if (!budget.claim_replacements(needed_bytes, all)) {
        ++stats.postponed_replacements;
        wanted_replacement_bytes = needed_bytes;
        is_replacement_wanted = true;
        must_plan = true;
        return false;
    }
    wanted_replacement_bytes = 0;
    switch_source();
    contact.forget_heights();
    stats.peak_bytes = std::max(stats.peak_bytes, budget.bytes());
    for (auto& [index, chunk] : resident) {
        all.shrink(all.bytes() - chunk->bytes());  // nothing else claims meanwhile
        std::shared_ptr<const Chunk> owned = claimed(chunk, ByteClaim(bytes, chunk->bytes()));
        tree.replace(index, owned);
        replaced_keys.push_back(owned->key);
        arrived.push_back(std::move(owned));
        ++stats.replaced;
    }
    for (const ChunkKey& key : changed) tree.refresh_above(key);
    std::erase_if(orphans, [&](const auto& entry) {
        const bool is_outdated = !source->is_current(*entry.second.chunk);
        stats.outdated += is_outdated ? 1u : 0u;
        return is_outdated;
    });
    return true;
}

}  // namespace terrane
