// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

// The slope map of a chunk: shading normals at its samples for baselines of 1, 2, 4 ... 128 samples, so that a pixel is
// lit with the slope at its own size, whichever triangle covers it.
//
// Layer k: samples at multiples of 2^k, central differences of heights 2^k samples apart. As a coarse sample is the
// fine sample at that point, layer k of a chunk and layer k - 1 of its parent agree bit for bit where they overlap, and
// so do neighbours along their shared edge: the light has no seam between chunks of any levels.

inline constexpr int kSlopeLayers = 8;  ///< 129, 65, 33, 17, 9, 5, 3 and 2 samples wide
inline constexpr int kSlopeMapWidth = kChunkSamples;
inline constexpr int kSlopeMapHeight = 2 * kChunkCells - 1 + kSlopeLayers;

/// First row of a layer; layers are stacked from the south.
constexpr int slope_layer_row(int layer) {
    return 2 * kChunkCells - (2 * kChunkCells >> layer) + layer;
}
static_assert(slope_layer_row(kSlopeLayers) == kSlopeMapHeight);

/// For each side (west, east, south, north) the level of the finest resident neighbour that is no finer than this
/// chunk; -1 beyond the edge of the world.
using SideLevels = std::array<int, 4>;
SideLevels find_side_levels(const ResidentSet& resident, const ChunkKey& key);

/// x and y of unit normals (z is positive), scaled by 32767: [kSlopeMapHeight * kSlopeMapWidth * 2].
///
/// Heights beyond the edges come from resident neighbours; where none is fine enough the difference is one-sided.
std::vector<std::int16_t> make_slope_map(const ResidentSet& resident, const Chunk& chunk,
                                         const SideLevels& side_levels);

}  // namespace terrane::internal
