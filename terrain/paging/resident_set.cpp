// SPDX-License-Identifier: MIT
#include <terrane/terrain/assert.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <tuple>

namespace terrane {
namespace {

[[maybe_unused]] bool are_fades(std::span<const float> fades) {
    return std::all_of(fades.begin(), fades.end(),
                       [](float fade) { return fade >= 0.0f && fade <= 1.0f; });
}

}  // namespace

std::shared_ptr<const ResidentSet::Structure> ResidentSet::make_structure(
    const Lattice& lattice, const WorldRect& extent,
    std::vector<std::shared_ptr<const Chunk>> chunks) {
    auto made = std::make_shared<Structure>();
    made->lattice = lattice;
    made->extent = extent;
    made->chunks = std::move(chunks);
    const auto order = [](const std::shared_ptr<const Chunk>& a,
                          const std::shared_ptr<const Chunk>& b) {
        return std::tie(a->key.level, a->key.y, a->key.x) <
               std::tie(b->key.level, b->key.y, b->key.x);
    };
    std::sort(made->chunks.begin(), made->chunks.end(), order);
    made->index.reserve(made->chunks.size());
    for (std::size_t i = 0; i < made->chunks.size(); ++i) {
        const bool is_new =
            made->index.emplace(made->chunks[i]->key, static_cast<std::int32_t>(i)).second;
        TERRANE_ASSERT(is_new, "no chunk may be resident twice");
        static_cast<void>(is_new);
    }

    made->links.resize(made->chunks.size());
    std::size_t root_count = 0;
    for (std::size_t i = 0; i < made->chunks.size(); ++i) {
        const ChunkKey& key = made->chunks[i]->key;
        Links& links = made->links[i];
        const std::array<ChunkKey, 4> neighbours{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        for (std::size_t side = 0; side < 4; ++side) {
            links.neighbour[side] = made->find(neighbours[side]);
        }
        if (key.level == 0) {
            ++root_count;
            continue;
        }
        links.parent = made->find(key.parent());
        TERRANE_ASSERT(links.parent != kNone, "the parent of a resident chunk must be resident");
        made->links[static_cast<std::size_t>(links.parent)]
            .child[static_cast<std::size_t>(key.quadrant())] = static_cast<std::int32_t>(i);
    }
    made->has_roots = root_count == static_cast<std::size_t>(lattice.root_count_x) *
                                        static_cast<std::size_t>(lattice.root_count_y);
    return made;
}

ResidentSet::ResidentSet(const Lattice& lattice, const WorldRect& extent,
                         std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch)
    : structure_(make_structure(lattice, extent, std::move(chunks))), epoch_(epoch) {
    fades_.assign(structure_->chunks.size(), 1.0f);
}

ResidentSet::ResidentSet(const Lattice& lattice, const WorldRect& extent,
                         std::vector<std::shared_ptr<const Chunk>> chunks,
                         std::span<const float> fades, std::uint64_t epoch)
    : structure_(make_structure(lattice, extent, chunks)), epoch_(epoch) {
    TERRANE_ASSERT(fades.size() == chunks.size() && are_fades(fades),
                   "each chunk needs a fade of 0 to 1");
    fades_.resize(fades.size());
    for (std::size_t i = 0; i < fades.size(); ++i) {
        fades_[static_cast<std::size_t>(find(chunks[i]->key))] = fades[i];
    }
}

ResidentSet::ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch)
    : structure_(same.structure_), fades_(std::move(fades)), epoch_(epoch) {
    TERRANE_ASSERT(fades_.size() == structure_->chunks.size() && are_fades(fades_),
                   "each chunk needs a fade of 0 to 1");
}

std::int32_t ResidentSet::Structure::find(const ChunkKey& key) const {
    const auto found = index.find(key);
    return found == index.end() ? kNone : found->second;
}

std::int32_t ResidentSet::find(const ChunkKey& key) const { return structure_->find(key); }

}  // namespace terrane
