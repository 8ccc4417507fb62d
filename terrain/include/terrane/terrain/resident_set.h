// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// The default of TriangulatorSettings::morph_ratio; the pace at which chunks fade follows from it. Measured over steep
/// rasters at 10 m a frame: 0.59 px of movement at 1.15, 0.32 at 1.3, for 4 % more triangles.
inline constexpr double kDefaultMorphRatio = 1.3;

/// A chunk of a ResidentSet. Reads like a pointer while the set lives, and gives a share of the chunk
/// to who needs it longer. Not copied, for a copy would keep nothing alive.
class ResidentChunk {
public:
    explicit ResidentChunk(const std::shared_ptr<const Chunk>& owner)
        : chunk_(owner.get()), owner_(&owner) {}
    ResidentChunk(ResidentChunk&&) = default;
    ResidentChunk& operator=(ResidentChunk&&) = default;

    const Chunk& operator*() const { return *chunk_; }
    const Chunk* operator->() const { return chunk_; }
    const Chunk* get() const { return chunk_; }
    operator const std::shared_ptr<const Chunk>&() const { return *owner_; }

private:
    const Chunk* chunk_;
    const std::shared_ptr<const Chunk>* owner_;
};

/// The chunks that were resident at one moment: immutable, shared by drawing and contact.
///
/// Every chunk's parent is in the set too (roots have none). Sets that differ only in their fades
/// share everything else. Threads: any number of readers; lives as long as anybody holds it.
class ResidentSet {
public:
    static constexpr std::int32_t kNone = -1;

    /// The order of chunks(): level, then y, then x.
    struct Order {
        constexpr bool operator()(const ChunkKey& a, const ChunkKey& b) const {
            if (a.level != b.level) return a.level < b.level;
            return a.y != b.y ? a.y < b.y : a.x < b.x;
        }
    };

    /// Where the relatives of a chunk stand in chunks(), or kNone.
    struct Links {
        std::int32_t parent = kNone;
        std::array<std::int32_t, 4> child{kNone, kNone, kNone, kNone};  ///< by quadrant
        std::array<std::int32_t, 4> neighbour{kNone, kNone, kNone,
                                              kNone};  ///< same level: west, east, south, north
    };

    /// All of it faded in. Requires every chunk's parent among the chunks, and no chunk twice.
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch);

    /// @param fades [chunks.size()] in the order of the chunks as they are given, 0 to 1
    ResidentSet(const Lattice& lattice, const WorldRect& extent,
                std::vector<std::shared_ptr<const Chunk>> chunks, std::span<const float> fades,
                std::uint64_t epoch);

    /// The chunks of another set, without those that went and with those that came: equal to the set
    /// that is made of all of them at once. Cost: linear, some 10 ns a chunk; relatives are looked up
    /// and owners counted only where something changed.
    ///
    /// @param gone keys of chunks of `before`, none twice, in any order
    /// @param come in any order; the key of one that went may come again
    /// @param fades [chunks().size()] of all of them, in the order of chunks(), 0 to 1
    ResidentSet(const ResidentSet& before, std::span<const ChunkKey> gone,
                std::vector<std::shared_ptr<const Chunk>> come, std::vector<float> fades,
                std::uint64_t epoch);

    /// The chunks of another set with other fades. Shares the chunks; costs one vector.
    ///
    /// @param fades [same.chunks().size()] in the order of same.chunks(), 0 to 1
    ResidentSet(const ResidentSet& same, std::vector<float> fades, std::uint64_t epoch);

    const Lattice& lattice() const { return structure_->lattice; }
    /// Ground lies inside it; what is drawn beyond is no ground.
    const WorldRect& extent() const { return structure_->extent; }
    /// In Order.
    std::span<const ResidentChunk> chunks() const { return structure_->chunks; }
    const Links& links(std::size_t index) const { return structure_->links[index]; }
    /// Index of a chunk in chunks(), or kNone.
    std::int32_t find(const ChunkKey& key) const;
    /// The chunk itself, or null. Sooner than by its index.
    const Chunk* find_chunk(ChunkKey key) const;
    /// How far a chunk has faded in, 0 to 1: what it adds to the picture is held back to this share of
    /// its priority. 0 draws as if the chunk were absent, 1 all of it. Ground does not fade.
    float fade(std::size_t index) const { return fades_[index]; }
    /// [chunks().size()] of fade().
    std::span<const float> fades() const { return fades_; }
    /// Counts the changes of the pager's set, those of fades too; two sets of one pager with one epoch
    /// are equal.
    std::uint64_t epoch() const { return epoch_; }
    /// Whether the two share their chunks and so differ at most in fades. One comparison: false for
    /// equal chunks that were put together apart.
    bool has_same_chunks(const ResidentSet& other) const { return structure_ == other.structure_; }
    /// Whether all root squares are there: nothing can be drawn before.
    bool has_roots() const { return structure_->has_roots; }

private:
    class Change;
    struct Owners;
    struct Structure {
        Lattice lattice;
        WorldRect extent;
        std::vector<ResidentChunk> chunks;
        std::vector<ChunkKey> keys;  // of the chunks: close together, for look-ups
        std::vector<Links> links;
        bool has_roots = false;
        // What find() reads: the index of a key stands in the place that its hash names, or in the
        // next that is free. 2^(64 - table_shift) places, at most half of them taken.
        std::vector<std::int32_t> table{kNone, kNone};
        int table_shift = 63;
        // What keeps the chunks: in slots of blocks, which sets share.
        std::vector<std::shared_ptr<const Owners>> owners;
        std::vector<std::int32_t> slots;  // of the chunks
        std::vector<std::int32_t> free_slots;

        std::size_t place(const ChunkKey& key) const;
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
