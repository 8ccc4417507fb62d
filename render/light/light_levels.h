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

// The slope map of a chunk has shading normals at its samples for baselines of 1, 2, 4 ... 128 samples, so that a pixel
// is lit with the slope over its own footprint, whichever triangle covers the pixel.
//
// Layer k has the samples whose column and row are multiples of 2^k. Their slopes are central differences over 2^k
// samples to either side. A coarse sample equals the fine sample at the same point. Layer k of a chunk is therefore
// bit-identical to layer k - 1 of its parent where the two overlap, and to layer k of a neighbour along their shared
// edge: lighting has no seams between chunks of any levels.

inline constexpr int kSlopeLayers = 8;  ///< 129, 65, 33, 17, 9, 5, 3 and 2 samples wide
inline constexpr int kSlopeMapWidth = kChunkSamples;
inline constexpr int kSlopeMapHeight = 2 * kChunkCells - 1 + kSlopeLayers;

/// First row of a layer; layers are stacked from south to north.
constexpr int slope_layer_row(int layer) {
    return 2 * kChunkCells - (2 * kChunkCells >> layer) + layer;
}
static_assert(slope_layer_row(kSlopeLayers) == kSlopeMapHeight);

/// For each side (west, east, south, north), the level of the finest resident neighbour that is not finer than this
/// chunk; -1 if no neighbour is resident, as at the edge of the world.
using SideLevels = std::array<int, 4>;
SideLevels find_side_levels(const ResidentSet& resident, const ChunkKey& key);

/// A slope map: x and y of unit normals (z is positive), scaled by 32767: [kSlopeMapHeight * kSlopeMapWidth * 2].
///
/// Heights beyond the edges come from resident neighbours; if no neighbour has the sample, the difference is one-sided.
std::vector<std::int16_t> make_slope_map(const ResidentSet& resident, const Chunk& chunk,
                                         const SideLevels& side_levels);

/// The bends of a chunk's ground, in the layout of a slope map, scaled by 32767: [kSlopeMapHeight * kSlopeMapWidth].
///
/// A bend is the mean of the four samples one baseline away minus the sample, over the baseline: above 0 in hollows, a
/// curvature times a length, hence comparable at all baselines. It is clamped to -1 to 1, and is as free of seams as
/// slopes are. An axis on which a neighbour is absent does not bend.
std::vector<std::int16_t> make_bend_map(const ResidentSet& resident, const Chunk& chunk,
                                        const SideLevels& side_levels);

/// The light level at one of the nine nodes of a chunk: corners, midpoints of sides, and centre.
struct LightNode {
    float level = 0.0f;  ///< contributions of all levels up to the chunk's, 0 to that level
    float own = 0.0f;    ///< contribution of the chunk's own level, 0 to 1
    friend bool operator==(const LightNode&, const LightNode&) = default;
};
/// Row by row from the south-west.
using LightNodes = std::array<LightNode, 9>;

/// A chunk whose slope map is used for lighting.
struct LitChunk {
    ChunkKey key;
    const Chunk* chunk = nullptr;
    int layer = -1;  ///< 0 to max_chunks - 1, unique
    LightNodes nodes{};
};

/// Computes the light level, a continuous field over the ground: the finest chunk level whose slopes light a point.
///
/// Each level contributes 0 to 1, interpolated bilinearly between nodes half a chunk apart. Its contribution at a node
/// is the smallest presence of the chunks of that level that touch the node. A chunk that is not resident has presence
/// 0; presence changes in kFadeFrames steps as chunks are loaded and evicted. Hence the field is continuous across all
/// borders, between any two levels, and in time. The sum over all coarser levels is bilinear between the same nodes, so
/// a shader needs only the nine values of a chunk, see shade.frag.
///
/// A chunk is omitted if its parent's spacing is at most a pixel at the chunk's nearest point, because the parent then
/// gives the same lighting.
class LightLevels {
public:
    static constexpr int kFadeFrames = 16;

    /// @param max_chunks limit of lit chunks, 1 or more; beyond it the finest are omitted
    explicit LightLevels(int max_chunks);

    /// Call once a frame. A newly resident chunk fades in, unless its parent arrived in the same frame, or the eye has
    /// moved by more than a tenth of the chunk's distance since the last frame. A chunk fades out while its
    /// ResidentSet::fade() falls. In the first frame all chunks are present at once.
    void update(const std::shared_ptr<const ResidentSet>& resident, const View& view);

    /// The lit chunks from coarse to fine; children follow their parents. Valid until the next update().
    std::span<const LitChunk> lit() const { return lit_; }
    /// Number of layers of resident chunks, lit in this frame or earlier.
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
        int lit_index = -1;  ///< valid if lit_frame is the current frame
    };

    void follow(const std::shared_ptr<const ResidentSet>& resident, const View& view);
    void fade(const ResidentSet& resident);
    void choose(const ResidentSet& resident, const View& view);
    bool allocate_layer(Record& record);
    float presence_at(const ResidentSet& resident, const ChunkKey& key) const;
    LightNodes make_nodes(const ResidentSet& resident, const LitChunk& lit) const;

    std::uint64_t frame_ = 0;
    std::weak_ptr<const ResidentSet> followed_;
    WorldPos last_eye_ = WorldPos::Zero();
    std::map<ChunkKey, Record> records_;
    std::vector<Record*> record_of_;  // [index in the set]
    std::vector<int> free_layers_;
    std::vector<LitChunk> lit_;
    std::vector<std::int32_t> lit_indices_;  // [lit_] in the set
    int starved_level_ = 0;                  // chunks of this level and finer may lack a layer
};

}  // namespace terrane::internal
