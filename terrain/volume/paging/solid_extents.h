// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <unordered_map>

namespace terrane::internal {

/// What volumes add to the heightfield over each chunk, of all levels.
///
/// Below the heightfield only what was removed matters, above it only what was added. The heightfield alone leaves out
/// surfaces at most as far from it as their vertical distance, and its own points over a void are at most as far above
/// the floor there.
class SolidExtents {
public:
    SolidExtents(const HeightSource& heights, const Volumes& volumes);

    /// Of a chunk of any level; none where there is no volume. Cost: O(1)
    std::optional<SolidExtent> of_chunk(const ChunkKey& key) const;
    /// Encloses the volumes over a rectangle; none where there are none. Cost: O(chunks of one level under it), which
    /// are at most 4
    std::optional<HeightInterval> over(const WorldRect& rect) const;
    /// Upper estimate of the area of surfaces over a chunk of the finest level, m^2.
    double area(const ChunkKey& key) const;

private:
    struct Extent {
        SolidExtent solid;
        double area = 0.0;
    };
    void include(const ChunkKey& key, const Extent& extent);

    Lattice lattice_;
    std::unordered_map<ChunkKey, Extent, ChunkKeyHash> chunks_;  // never iterated
};

/// Sizes of chunks that have turned out larger than their estimate. Threads: any number
class SolidSizes {
public:
    /// The recorded size, or 0.
    std::size_t of(const ChunkKey& key) const;
    void record(const ChunkKey& key, std::size_t bytes);

private:
    mutable std::mutex mutex_;
    std::map<ChunkKey, std::size_t> bytes_;
};

}  // namespace terrane::internal
