// SPDX-License-Identifier: MIT
#include "chunks/resident_set_change.h"
#include "chunks/root_window.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <utility>

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
    Structure none;
    none.lattice = lattice;
    none.extent = extent;
    return Change(none, internal::first_root_window(lattice)).make({}, std::move(chunks));
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
    for (std::size_t i = 0; i < fades.size(); ++i) fades_[at(find(chunks[i]->key))] = fades[i];
}

ResidentSet::ResidentSet(const ResidentSet& before, std::span<const ChunkKey> evicted,
                         std::vector<std::shared_ptr<const Chunk>> arrived,
                         std::vector<float> fades, std::uint64_t epoch, const Lattice& window)
    : structure_(Change(*before.structure_, window).make(evicted, std::move(arrived))),
      fades_(std::move(fades)),
      epoch_(epoch) {
    TERRANE_ASSERT(fades_.size() == structure_->chunks.size() && are_fades(fades_),
                   "each chunk needs a fade of 0 to 1");
}

ResidentSet::ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch)
    : structure_(same.structure_), fades_(std::move(fades)), epoch_(epoch) {
    TERRANE_ASSERT(fades_.size() == structure_->chunks.size() && are_fades(fades_),
                   "each chunk needs a fade of 0 to 1");
}

std::int32_t ResidentSet::Structure::find(const ChunkKey& key) const {
    return table[bucket_of(key)];
}

std::int32_t ResidentSet::find(const ChunkKey& key) const { return structure_->find(key); }

const Chunk* ResidentSet::find_chunk(ChunkKey key) const {
    const Structure& structure = *structure_;
    const std::int32_t found = structure.table[structure.bucket_of(key)];
    return found == kNone ? nullptr : structure.chunks[at(found)].get();
}

}  // namespace terrane
