// SPDX-License-Identifier: MIT
#pragma once

#include "gl_object.h"
#include "slope_map.h"

#include <terrane/terrain/resident_set.h>

#include <map>
#include <memory>

namespace terrane::internal {

/// What the device holds of one chunk.
struct DeviceChunk {
    std::weak_ptr<const Chunk> chunk;  ///< to tell a chunk from its successor under the same key
    GlBuffer heights;                  ///< [kChunkSamples^2] 32-bit quanta
    GlTexture slopes;                  ///< see slope_map.h
    SideLevels side_levels{};          ///< that the slopes were made with
};

/// Keeps the chunks that were drawn on the device for as long as they are resident.
class ChunkCache {
public:
    /// Forgets what is not in the set any more. Call before find() where the set may have changed.
    void follow(const ResidentSet& resident);

    /// Of a chunk of the set that was followed last; uploads it where it is not there, and its slopes
    /// again where its neighbourhood has changed. Null where the set does not hold the chunk.
    const DeviceChunk* find(const ResidentSet& resident, const Chunk& chunk);

    std::size_t bytes() const;

private:
    std::map<ChunkKey, DeviceChunk> chunks_;
};

}  // namespace terrane::internal
