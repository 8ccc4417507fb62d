// SPDX-License-Identifier: MIT
#include <terrane/terrain/assert.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <tuple>

namespace terrane {

ResidentSet::ResidentSet(const Lattice& lattice, const WorldRect& extent,
                         std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch)
    : lattice_(lattice), extent_(extent), chunks_(std::move(chunks)), epoch_(epoch) {
    const auto order = [](const std::shared_ptr<const Chunk>& a,
                          const std::shared_ptr<const Chunk>& b) {
        return std::tie(a->key.level, a->key.y, a->key.x) <
               std::tie(b->key.level, b->key.y, b->key.x);
    };
    std::sort(chunks_.begin(), chunks_.end(), order);
    index_.reserve(chunks_.size());
    for (std::size_t i = 0; i < chunks_.size(); ++i) {
        const bool is_new = index_.emplace(chunks_[i]->key, static_cast<std::int32_t>(i)).second;
        TERRANE_ASSERT(is_new, "no chunk may be resident twice");
        static_cast<void>(is_new);
    }

    fades_.assign(chunks_.size(), 1.0f);
    links_.resize(chunks_.size());
    std::size_t root_count = 0;
    for (std::size_t i = 0; i < chunks_.size(); ++i) {
        const ChunkKey& key = chunks_[i]->key;
        Links& links = links_[i];
        const std::array<ChunkKey, 4> neighbours{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        for (std::size_t side = 0; side < 4; ++side) links.neighbour[side] = find(neighbours[side]);
        if (key.level == 0) {
            ++root_count;
            continue;
        }
        links.parent = find(key.parent());
        TERRANE_ASSERT(links.parent != kNone, "the parent of a resident chunk must be resident");
        links_[static_cast<std::size_t>(links.parent)]
            .child[static_cast<std::size_t>(key.quadrant())] = static_cast<std::int32_t>(i);
    }
    has_roots_ = root_count == static_cast<std::size_t>(lattice_.root_count_x) *
                                   static_cast<std::size_t>(lattice_.root_count_y);
}

std::int32_t ResidentSet::find(const ChunkKey& key) const {
    const auto found = index_.find(key);
    return found == index_.end() ? kNone : found->second;
}

}  // namespace terrane
