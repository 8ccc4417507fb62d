// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/volume/volumes.h>

#include <optional>
#include <unordered_map>

namespace terrane::internal {

/// What volumes add to the heightfield over a chunk.
struct ChunkExtent {
    SolidExtent solid;
    double area = 0.0;  ///< upper estimate of the area of surfaces, m^2

    friend bool operator==(const ChunkExtent& a, const ChunkExtent& b) {
        return a.solid.error_m == b.solid.error_m && a.solid.heights.low == b.solid.heights.low &&
               a.solid.heights.high == b.solid.heights.high && a.area == b.area;
    }
};

/// Both together; areas add up.
std::optional<ChunkExtent> united(const std::optional<ChunkExtent>& a,
                                  const std::optional<ChunkExtent>& b);

/// What one operation adds to the heightfield over a tile that it touches; none if nothing.
///
/// Cost: that of HeightSource::interval()
std::optional<ChunkExtent> extent_of(const HeightSource& heights, const Volumes& volumes,
                                     VolumeOp op, const VolumeTilePart& part);

/// What volumes add to the heightfield over each chunk, of all levels: a function of the extents of the chunks of the
/// pinned level.
///
/// Below the heightfield only what was removed matters, above it only what was added. The heightfield alone leaves out
/// surfaces at most as far from it as their vertical distance, and its own points over a void are at most as far above
/// the floor there.
///
/// Threads: any number that read, or one that changes it
class SolidExtents {
public:
    SolidExtents(const HeightSource& heights, const Volumes& volumes);

    /// Of a chunk of any level; none where there is no volume. Cost: O(1)
    std::optional<ChunkExtent> of_chunk(const ChunkKey& key) const;
    /// Encloses the volumes over a rectangle; none where there are none. Cost: O(chunks of one level under it), which
    /// are at most 4
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Changes that of a chunk of the pinned level, and what follows from it above. Cost: O(levels)
    void set(const ChunkKey& key, const std::optional<ChunkExtent>& extent);

private:
    Lattice lattice_;
    std::unordered_map<ChunkKey, ChunkExtent, ChunkKeyHash> chunks_;  // order does not matter
};

}  // namespace terrane::internal
