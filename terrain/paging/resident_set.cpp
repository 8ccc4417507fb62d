// SPDX-License-Identifier: MIT
#include "resident_set_change.h"

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

std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

}  // namespace

std::shared_ptr<const ResidentSet::Structure> ResidentSet::make_structure(
    const Lattice& lattice, const WorldRect& extent,
    std::vector<std::shared_ptr<const Chunk>> chunks) {
    Structure none;
    none.lattice = lattice;
    none.extent = extent;
    return Change(none).make({}, std::move(chunks));
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

ResidentSet::ResidentSet(const ResidentSet& before, std::span<const ChunkKey> gone,
                         std::vector<std::shared_ptr<const Chunk>> come, std::vector<float> fades,
                         std::uint64_t epoch)
    : structure_(Change(*before.structure_).make(gone, std::move(come))),
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

// Where a key stands in the table, or would. Keys lie in rows and squares: multiples of an odd number
// spread these over the upper bits more evenly than chance would.
std::size_t ResidentSet::Structure::place(const ChunkKey& key) const {
    const std::uint64_t packed =
        static_cast<std::uint32_t>(key.x) | std::uint64_t{static_cast<std::uint32_t>(key.y)} << 32;
    const std::uint64_t hash = (packed + key.level * 0xd1b54a32d192ed03u) * 0x9e3779b97f4a7c15u;
    const std::size_t mask = table.size() - 1;
    std::size_t place = hash >> table_shift;
    while (table[place] != kNone && keys[at(table[place])] != key) place = (place + 1) & mask;
    return place;
}

std::int32_t ResidentSet::Structure::find(const ChunkKey& key) const { return table[place(key)]; }

std::int32_t ResidentSet::find(const ChunkKey& key) const { return structure_->find(key); }

}  // namespace terrane
