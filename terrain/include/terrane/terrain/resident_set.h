// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Default of TriangulatorSettings::morph_ratio; also determines the step of fades. Measured over steep
/// rasters at 10 m a frame: 0.59 px of movement at 1.15, 0.32 at 1.3, for 4 % more triangles.
inline constexpr double kDefaultMorphRatio = 1.3;

/// A chunk of a ResidentSet: a pointer, valid while the set lives, that converts to a shared_ptr for longer use. Not
/// copyable, because a copy would not keep the chunk alive.
class ResidentChunk {
public:
    /// Of a shared_ptr that outlives it.
    explicit ResidentChunk(const std::shared_ptr<const Chunk>& owner)
        : chunk_(owner.get()), owner_(&owner) {}
    ResidentChunk(ResidentChunk&&) = default;
    ResidentChunk& operator=(ResidentChunk&&) = default;

    /// The chunk; there must be one.
    const Chunk& operator*() const { return *chunk_; }
    /// The chunk; there must be one.
    const Chunk* operator->() const { return chunk_; }
    /// The chunk, or null.
    const Chunk* get() const { return chunk_; }
    /// For longer use than the set's life.
    operator const std::shared_ptr<const Chunk>&() const { return *owner_; }

private:
    const Chunk* chunk_;
    const std::shared_ptr<const Chunk>* owner_;
};

/// A snapshot of the resident chunks: immutable, shared by drawing and contact.
///
/// Every chunk's parent is in the set too (roots have none). Sets that differ only in their fades
/// share everything else. Threads: any number of readers.
class ResidentSet {
public:
    static constexpr std::int32_t kNone = -1;  ///< index that stands for no chunk

    /// The order of chunks(): level, then y, then x.
    struct Order {
        /// Whether a is before b.
        constexpr bool operator()(const ChunkKey& a, const ChunkKey& b) const {
            if (a.level != b.level) return a.level < b.level;
            return a.y != b.y ? a.y < b.y : a.x < b.x;
        }
    };

    /// Indices in chunks() of a chunk's parent, children and neighbours, or kNone.
    struct Links {
        std::int32_t parent = kNone;  ///< index of the parent, or kNone
        std::array<std::int32_t, 4> child{kNone, kNone, kNone, kNone};  ///< by quadrant
        std::array<std::int32_t, 4> neighbour{kNone, kNone, kNone,
                                              kNone};  ///< same level: west, east, south, north
    };

    /// All chunks with fade 1. Where the lattice has a root window it lies around the lattice's origin. Requires every
    /// chunk's parent among the chunks, and no chunk twice.
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch);

    /// @param fades [chunks.size()] in the order of `chunks`, 0 to 1
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::span<const float> fades,
                std::uint64_t epoch);

    /// Another set without its evicted and with newly arrived chunks: equal to the set constructed from all of
    /// them. Cost: linear, some 10 ns a chunk; relatives and reference counts are updated only where something
    /// changed.
    ///
    /// @param evicted keys of chunks of `before`, none twice, in any order
    /// @param arrived in any order; may contain a key of `evicted`
    /// @param fades [chunks().size()] of the new set, in the order of chunks(), 0 to 1
    /// @param window window() of the new set
    ResidentSet(const ResidentSet& before, std::span<const ChunkKey> evicted,
                std::vector<std::shared_ptr<const Chunk>> arrived, std::vector<float> fades,
                std::uint64_t epoch, const Lattice& window);

    /// Another set with other fades. Shares the chunks; costs one vector.
    ///
    /// @param fades [same.chunks().size()] in the order of same.chunks(), 0 to 1
    ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch);

    /// The lattice of the source.
    const Lattice& lattice() const { return structure_->lattice; }
    /// The lattice reduced to the root squares that are resident or requested: those of the root window, or all where
    /// lattice() has none. Its own root_window is 0. Meshes cover these root squares; chunks outside of them are not
    /// resident.
    const Lattice& window() const { return structure_->window; }
    /// The rectangle of the ground; what is drawn beyond it is no ground.
    const WorldRect& extent() const { return structure_->extent; }
    /// In Order.
    std::span<const ResidentChunk> chunks() const { return structure_->chunks; }
    /// Of the chunk at an index of chunks().
    const Links& links(std::size_t index) const { return structure_->links[index]; }
    /// Indices in chunks() of those that have a Chunk::solid, ascending.
    std::span<const std::int32_t> solids() const { return structure_->solids; }
    /// Index of a chunk in chunks(), or kNone.
    std::int32_t find(const ChunkKey& key) const;
    /// The chunk, or null. Faster than by its index.
    const Chunk* find_chunk(ChunkKey key) const;
    /// Fade of a chunk, 0 to 1: the factor on the priorities of its vertices. 0 draws as if the chunk were absent, 1
    /// without reduction. Ground does not fade.
    float fade(std::size_t index) const { return fades_[index]; }
    /// [chunks().size()] fade() of each chunk.
    std::span<const float> fades() const { return fades_; }
    /// Counts the changes of the pager's set, including fades: sets of one pager with equal epochs are equal.
    std::uint64_t epoch() const { return epoch_; }
    /// Whether two sets share their chunks and so differ at most in fades. One comparison of pointers: false for
    /// sets with equal chunks that were constructed separately.
    bool has_same_chunks(const ResidentSet& other) const { return structure_ == other.structure_; }
    /// Whether all root squares of the window are resident: without them nothing is drawn.
    bool has_roots() const { return structure_->has_roots; }
    /// Whether volumes cut or add to the heightfield of any chunk: see Chunk::solid.
    bool has_solids() const { return !structure_->solids.empty(); }

private:
    class Change;
    struct Owners;
    struct Structure {
        Lattice lattice, window;
        WorldRect extent;
        std::vector<ResidentChunk> chunks;
        std::vector<ChunkKey> keys;  // of the chunks: contiguous, for look-ups
        std::vector<Links> links;
        std::vector<std::int32_t> solids;  // chunks with a solid surface, ascending
        bool has_roots = false;
        // Open addressing with linear probing: indices by the hash of their keys. 2^(64 - table_shift) entries,
        // at most half of them in use.
        std::vector<std::int32_t> table{kNone, kNone};
        int table_shift = 63;
        // Ownership of the chunks: slots in blocks that sets share.
        std::vector<std::shared_ptr<const Owners>> owners;
        std::vector<std::int32_t> slots;  // of the chunks
        std::vector<std::int32_t> free_slots;

        std::size_t bucket_of(const ChunkKey& key) const;
        std::int32_t find(const ChunkKey& key) const;
    };
    static std::shared_ptr<const Structure> make_structure(
        const Lattice& lattice, const WorldRect& extent,
        std::vector<std::shared_ptr<const Chunk>> chunks);

    std::shared_ptr<const Structure> structure_;
    std::vector<float> fades_;
    std::uint64_t epoch_ = 0;
};

}  // namespace terrane
