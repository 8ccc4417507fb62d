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

/// The light level at one of the nine nodes of a chunk: corners, midpoints of sides, and centre.
struct LightNode {
    float level = 0.0f;  ///< sum over all levels up to the chunk's, 0 to its level
    float own = 0.0f;    ///< contribution of the chunk's own level, 0 to 1
    friend bool operator==(const LightNode&, const LightNode&) = default;
};
/// Row by row from the south-west.
using LightNodes = std::array<LightNode, 9>;

/// A chunk whose slope map the light uses.
struct LitChunk {
    ChunkKey key;
    const Chunk* chunk = nullptr;
    int layer = -1;  ///< 0 to max_chunks - 1, unique
    LightNodes nodes{};
};

/// The light level: a continuous field over the ground that says down to which chunk level the slopes are used.
///
/// Each level contributes 0 to 1: bilinear between nodes half a chunk apart; the value of a node is the least presence
/// of the chunks of that level that touch it. An absent chunk has presence 0; arriving and leaving chunks change theirs
/// in kFadeFrames steps. So the field is continuous across all borders, between any two levels, and in time. The sum
/// over all coarser levels is bilinear between the same nodes, so that the nine values of a chunk are all that a shader
/// needs: see shade.frag.
///
/// Chunks that are finer than pixels at their nearest point are left out: their parents give the same light there.
class LightLevels {
public:
    static constexpr int kFadeFrames = 16;

    /// @param max_chunks limit of lit chunks, 1 or more; beyond it the finest are left out
    explicit LightLevels(int max_chunks);

    /// Call once a frame. An arriving chunk fades in, unless its parent arrived with it, or the eye has moved more than
    /// a tenth of its distance since the last frame. A chunk whose ResidentSet::fade() falls fades out. The first frame
    /// shows everything.
    void update(const std::shared_ptr<const ResidentSet>& resident, const View& view);

    /// From coarse to fine; children follow their parents. Valid until the next update().
    std::span<const LitChunk> lit() const { return lit_; }
    /// Number of layers of resident chunks, lit now or before.
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
        int lit_index = -1;  ///< valid where lit_frame is the current frame
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
    std::vector<Record*> record_of_;  // [index in the set]
    std::vector<int> free_layers_;
    std::vector<LitChunk> lit_;
    std::vector<std::int32_t> lit_indices_;  // of lit_, in the set
    int starved_level_ = 0;                  // chunks of this level and finer may lack a layer
};

}  // namespace terrane::internal
