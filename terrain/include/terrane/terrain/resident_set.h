// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane {

/// The chunks that were resident at one moment: immutable, shared by drawing and contact.
///
/// Every chunk's parent is in the set too (roots have none). Order: level, then y, then x. Threads:
/// any number of readers; lives as long as anybody holds it.
class ResidentSet {
public:
    static constexpr std::int32_t kNone = -1;

    /// Where the relatives of a chunk stand in chunks(), or kNone.
    struct Links {
        std::int32_t parent = kNone;
        std::array<std::int32_t, 4> child{kNone, kNone, kNone, kNone};  ///< by quadrant
        std::array<std::int32_t, 4> neighbour{kNone, kNone, kNone,
                                              kNone};  ///< same level: west, east, south, north
    };

    /// Requires every chunk's parent among the chunks, and no chunk twice.
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch);

    const Lattice& lattice() const { return lattice_; }
    /// Ground lies inside it; what is drawn beyond is no ground.
    const WorldRect& extent() const { return extent_; }
    std::span<const std::shared_ptr<const Chunk>> chunks() const { return chunks_; }
    const Links& links(std::size_t index) const { return links_[index]; }
    /// Index of a chunk in chunks(), or kNone.
    std::int32_t find(const ChunkKey& key) const;
    /// How far a chunk has faded in, 0 to 1: what it adds to the picture is held back to this share of
    /// its priority. 0 draws as if the chunk were absent, 1 all of it. Ground does not fade.
    float fade(std::size_t index) const { return fades_[index]; }
    /// Counts the changes of the pager's set; two sets of one pager with one epoch are equal.
    std::uint64_t epoch() const { return epoch_; }
    /// Whether all root squares are there: nothing can be drawn before.
    bool has_roots() const { return has_roots_; }

private:
    Lattice lattice_;
    WorldRect extent_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
    std::vector<Links> links_;
    std::vector<float> fades_;
    std::unordered_map<ChunkKey, std::int32_t, ChunkKeyHash> index_;
    std::uint64_t epoch_ = 0;
    bool has_roots_ = false;
};

}  // namespace terrane
