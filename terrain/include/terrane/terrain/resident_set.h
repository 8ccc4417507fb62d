// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

namespace internal {
struct ChunkOutline;
}

/// Default of TriangulatorSettings::morph_ratio; also determines the step of fades. Measured over steep rasters at 10 m
/// a frame: vertices move by 0.59 px a frame at a ratio of 1.15, by 0.32 px at 1.3, which costs 4 % more triangles.
inline constexpr double kDefaultMorphRatio = 1.3;

/// A chunk of a ResidentSet: a pointer, valid while the set lives, that converts to a shared_ptr for longer use. Not
/// copyable, because a copy would not keep the chunk alive.
class ResidentChunk {
public:
    /// References a shared_ptr that must outlive this object.
    explicit ResidentChunk(const std::shared_ptr<const Chunk>& owner)
        : chunk_(owner.get()), owner_(&owner) {}
    ResidentChunk(ResidentChunk&&) = default;
    ResidentChunk& operator=(ResidentChunk&&) = default;

    /// The chunk. Requires one.
    const Chunk& operator*() const { return *chunk_; }
    /// The chunk. Requires one.
    const Chunk* operator->() const { return chunk_; }
    /// The chunk, or null.
    const Chunk* get() const { return chunk_; }
    /// Shared ownership, for use beyond the set's lifetime.
    operator const std::shared_ptr<const Chunk>&() const { return *owner_; }

private:
    const Chunk* chunk_;
    const std::shared_ptr<const Chunk>* owner_;
};

/// A resident chunk that only bodies need, and that is not drawn: of the contact level, or an ancestor of such a chunk.
/// Of most ancestors only the outline is resident, which bounds absent ground.
struct UndrawnChunk {
    ChunkKey key;                                           ///< of the chunk
    std::shared_ptr<const Chunk> chunk;                     ///< null: only the outline
    std::shared_ptr<const internal::ChunkOutline> outline;  ///< null: the whole chunk
};

/// A snapshot of the resident chunks: immutable, shared by drawing and contact.
///
/// chunks() are those to be drawn; the parent of every one of them is also there (roots have none). Undrawn chunks are
/// known to find_ground() and find_undrawn() only. Sets that differ only in their fades share everything else.
/// Threads: any number of readers.
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

    /// A set of these chunks, all with fade 1. If the lattice has a root window, window() is centred on the lattice's
    /// origin. Requires every chunk's parent among the chunks, and no duplicates.
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch);

    /// As above, with fades [chunks.size()] in the order of `chunks`, 0 to 1.
    ///
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::span<const float> fades,
                std::uint64_t epoch);

    /// A copy of another set without its evicted chunks and with newly arrived ones; equal to a set constructed from
    /// the resulting chunks. Cost: linear, about 10 ns per chunk; links and reference counts are updated only where
    /// something changed.
    ///
    /// @param evicted keys of chunks of `before`, no duplicates, in any order
    /// @param arrived in any order; may contain a key of `evicted`
    /// @param fades [chunks().size()] of the new set, in the order of chunks(), 0 to 1
    /// @param window window() of the new set
    ResidentSet(const ResidentSet& before, std::span<const ChunkKey> evicted,
                std::vector<std::shared_ptr<const Chunk>> arrived, std::vector<float> fades,
                std::uint64_t epoch, const Lattice& window);

    /// A copy of another set with other fades. Shares the chunks; allocates only the fades.
    ///
    /// @param fades [same.chunks().size()] in the order of same.chunks(), 0 to 1
    ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch);

    /// A copy of another set with other undrawn chunks. Shares everything else. Cost: proportional to the changes, and
    /// about a nanosecond per undrawn chunk.
    ///
    /// @param removed keys of undrawn chunks of `same`, no duplicates
    /// @param added   no duplicates; replaces a chunk of the same key
    ResidentSet(const ResidentSet& same, std::span<const ChunkKey> removed,
                std::span<const UndrawnChunk> added, std::uint64_t epoch);

    /// The lattice of the source.
    const Lattice& lattice() const { return structure_->lattice; }
    /// The lattice reduced to the root squares that are resident or requested: the root window, or all root squares if
    /// lattice() has no window. Its own root_window is 0. Meshes cover these root squares; chunks outside them are not
    /// resident.
    const Lattice& window() const { return structure_->window; }
    /// The rectangle with ground. The surface beyond it is drawn, but is not ground.
    const WorldRect& extent() const { return structure_->extent; }
    /// All chunks to be drawn, in Order.
    std::span<const ResidentChunk> chunks() const { return structure_->chunks; }
    /// Links of the chunk at an index of chunks().
    const Links& links(std::size_t index) const { return structure_->links[index]; }
    /// Indices of the chunks with a Chunk::solid, ascending.
    std::span<const std::int32_t> solids() const { return structure_->solids; }
    /// Index of a chunk in chunks(), or kNone.
    std::int32_t find(const ChunkKey& key) const;
    /// The chunk of chunks(), or null. Faster than find() followed by chunks().
    const Chunk* find_chunk(ChunkKey key) const;
    /// The chunk, drawn or undrawn, or null.
    const Chunk* find_ground(ChunkKey key) const;
    /// As find_ground(), with shared ownership.
    std::shared_ptr<const Chunk> share_ground(ChunkKey key) const;
    /// An undrawn chunk, or null. Valid while the set lives.
    const UndrawnChunk* find_undrawn(ChunkKey key) const;
    /// Number of undrawn chunks.
    std::size_t undrawn_count() const;
    /// Fade of a chunk, 0 to 1: a factor on the priorities of its vertices. At 0 the chunk is drawn as if it were
    /// absent, at 1 in full detail. Fades do not affect the contact surface.
    float fade(std::size_t index) const { return fades_[index]; }
    /// [chunks().size()] fade() of each chunk.
    std::span<const float> fades() const { return fades_; }
    /// Number of changes of the pager's set, including fades: two sets of one pager with equal epochs are equal.
    std::uint64_t epoch() const { return epoch_; }
    /// Whether two sets share their chunks() and differ at most in their fades and undrawn chunks. Compares one
    /// pointer: false for sets of equal chunks that were constructed separately.
    bool has_same_chunks(const ResidentSet& other) const { return structure_ == other.structure_; }
    /// Whether all root squares of the window are resident; otherwise nothing is drawn.
    bool has_roots() const { return structure_->has_roots; }
    /// Whether volumes change the heightfield of any chunk, drawn or undrawn: see Chunk::solid.
    bool has_solids() const;

private:
    class Change;
    class Undrawn;
    struct Owners;
    struct Structure {
        Lattice lattice, window;
        WorldRect extent;
        std::vector<ResidentChunk> chunks;
        std::vector<ChunkKey> keys;  // contiguous, for lookups
        std::vector<Links> links;
        std::vector<std::int32_t> solids;  // chunks with a solid surface, ascending
        bool has_roots = false;
        // Hash table with open addressing and linear probing: indices of chunks by the hash of their keys.
        // 2^(64 - table_shift) entries, at most half of them used.
        std::vector<std::int32_t> table{kNone, kNone};
        int table_shift = 63;
        // Ownership of the chunks: slots in blocks that are shared between sets.
        std::vector<std::shared_ptr<const Owners>> owners;
        std::vector<std::int32_t> slots;  // [chunks] slot of each
        std::vector<std::int32_t> free_slots;

        std::size_t bucket_of(const ChunkKey& key) const;
        std::int32_t find(const ChunkKey& key) const;
    };
    static std::shared_ptr<const Structure> make_structure(
        const Lattice& lattice, const WorldRect& extent,
        std::vector<std::shared_ptr<const Chunk>> chunks);

    std::shared_ptr<const Structure> structure_;
    std::shared_ptr<const Undrawn> undrawn_;  // null if there are none
    std::vector<float> fades_;
    std::uint64_t epoch_ = 0;
};

}  // namespace terrane
