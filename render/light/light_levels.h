// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// A value of the field of levels at one of the nine nodes of a chunk: its corners, the middles of its
/// sides, and its centre.
struct LightNode {
    float level = 0.0f;  ///< how fine light is there, 0 to the chunk's level
    float own = 0.0f;    ///< the share of it that this chunk's level adds, 0 to 1
    friend bool operator==(const LightNode&, const LightNode&) = default;
};
/// Row by row from the south-west.
using LightNodes = std::array<LightNode, 9>;

/// A chunk whose slopes light needs.
struct LitChunk {
    ChunkKey key;
    const Chunk* chunk = nullptr;
    int layer = -1;  ///< its own, 0 to max_chunks - 1
    LightNodes nodes{};
};

/// Which chunks light follows, and how far: a field over the ground that says down to which level.
///
/// Every level adds to the field what its chunks are worth, 0 to 1: bilinear between nodes half a
/// chunk apart, where the value of a node is the least presence of the chunks of that level that touch
/// it. A chunk that is absent has presence 0; one that comes or goes does so in kFadeFrames steps. So
/// the field is continuous across all borders, between chunks of any two levels, and from frame to
/// frame. The sum over all coarser levels is bilinear between the same nodes, which is why a chunk's nine
/// values are all that a shader has to know: see shade.frag.
///
/// Chunks that are finer than pixels at their nearest point are left out. Their parents' light is the
/// same there.
class LightLevels {
public:
    static constexpr int kFadeFrames = 16;

    /// @param max_chunks most chunks that are lit at once, 1 or more; the finest are left out
    explicit LightLevels(int max_chunks);

    /// Once a frame. A chunk that arrives fades in, unless its parent came with it, or the eye has
    /// moved more than a tenth of the way to it since the last frame. One whose ResidentSet::fade()
    /// falls fades out. The first frame shows everything.
    void update(const std::shared_ptr<const ResidentSet>& resident, const View& view);

    /// From coarse to fine, after every chunk its children. Until the next update().
    std::span<const LitChunk> lit() const { return lit_; }
    /// Layers of resident chunks, lit now or before.
    std::size_t layer_count() const;

private:
    struct Record {
        std::weak_ptr<const Chunk> chunk;
        std::uint64_t first_frame = 0;
        std::uint64_t lit_frame = 0;
        float presence = 1.0f;
        float fade = 1.0f;
        bool is_leaving = false;
        int layer = -1;
        int lit_index = -1;  ///< where lit_frame is now
    };

    void follow(const std::shared_ptr<const ResidentSet>& resident, const View& view);
    void fade(const ResidentSet& resident);
    void choose(const ResidentSet& resident, const View& view);
    bool take_layer(Record& record);
    float presence_at(const ResidentSet& resident, const ChunkKey& key) const;
    LightNodes make_nodes(const ResidentSet& resident, const LitChunk& lit) const;

    std::uint64_t frame_ = 0;
    std::weak_ptr<const ResidentSet> followed_;
    WorldPos last_eye_ = WorldPos::Zero();
    std::map<ChunkKey, Record> records_;
    std::vector<Record*> record_of_;  // by index in the set
    std::vector<int> free_layers_;
    std::vector<LitChunk> lit_;
    std::vector<std::int32_t> lit_indices_;  // in the set, of lit_
    int starved_level_ = 0;                  // chunks of this level and finer had no layer left
};

}  // namespace terrane::internal
