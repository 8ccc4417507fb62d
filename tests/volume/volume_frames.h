// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>
#include <terrane/volume/volumes.h>

#include <map>
#include <memory>
#include <vector>

namespace terrane::test {

// States of frames with volumes near a corner of four chunks of the finest level. A corner is numbered by the column
// and row of the chunk to the north-east: 4 is the middle of the world, 8 its north-eastern corner.

inline constexpr int kFinest = 3;  ///< level

std::shared_ptr<const HeightSource> random_hills(Random& random);

/// Volumes near the corner: on the ground, tangential to it, under it.
std::vector<VolumeOperation> random_operations(Random& random, const HeightSource& ground,
                                               int corner = 4);

/// Chunks of a source, made when they are needed first.
class Chunks {
public:
    explicit Chunks(const HeightSource& source) : source_(source) {}
    std::shared_ptr<const Chunk> get(const ChunkKey& key);

private:
    const HeightSource& source_;
    std::map<ChunkKey, std::shared_ptr<const Chunk>> made_;
};

/// The four chunks at the corner, their ancestors, and others; any of them may be absent or fading.
std::shared_ptr<const ResidentSet> random_residents(Random& random, Chunks& chunks,
                                                    const HeightSource& source, int corner = 4);

/// A view of the corner's surroundings from a distance.
View random_view(Random& random, double distance, int corner = 4);

}  // namespace terrane::test
