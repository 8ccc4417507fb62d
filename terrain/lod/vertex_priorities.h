// SPDX-License-Identifier: MIT
#pragma once

#include "screen_error.h"
#include "selection.h"

#include <terrane/terrain/resident_set.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Columns and rows of a chunk's samples, ends included.
struct SampleRange {
    int west = 0, south = 0, east = 0, north = 0;
};

/// Priorities of the vertices of one chunk that the view may refine, in pixels.
struct ChunkPriorities {
    /// The parts that were looked at: areas of the chunk, or all of it. Elsewhere both are 0, and no
    /// vertex is above the floor.
    std::vector<SampleRange> ranges;
    std::vector<float> own;      ///< [kChunkSamples^2] from bound and distance alone
    std::vector<float> trimmed;  ///< [kChunkSamples^2] at most those of the vertex's parents
};

/// Priorities of all vertices that may be above a floor, for one view of one resident set.
///
/// A vertex has at most the priority of its parents, and none where a parent is not resident: so
/// every set of vertices above a threshold is closed under parents, and its mesh conforms.
class VertexPriorities {
public:
    explicit VertexPriorities(const HeightSource& source);

    /// Opens every chunk that may have a vertex above the floor, and trims from the roots down.
    /// Root chunks are always open.
    void compute(std::shared_ptr<const ResidentSet> resident, const ScreenError& screen,
                 float floor);

    /// Appends every vertex above the floor, once. Returns the sum of their weights.
    std::size_t gather(float floor, std::vector<Candidate>& candidates) const;

    /// Priorities of a chunk of the resident set, nullptr where it was not opened: then none of its
    /// vertices is above the floor. ResidentSet::kNone is not open.
    const ChunkPriorities* find(std::int32_t index) const;

    /// Spacing of the coarsest vertices that a chunk owns, in its own samples.
    static int coarsest_stride(const Chunk& chunk) {
        return chunk.key.level == 0 ? kChunkCells / 2 : 1;
    }

private:
    std::size_t exponent(int level, int stride) const;
    std::vector<float> make_radius_rows(int level) const;
    std::int32_t slot_of(std::int32_t index) const;
    ChunkPriorities* open(std::int32_t index);
    void compute_own(const ScreenError& screen, const Chunk& chunk, float floor,
                     ChunkPriorities& into) const;
    void trim_centres(std::size_t index, const SampleRange& range, int stride);
    void trim_midpoints(std::size_t index, const SampleRange& range, int stride);
    std::size_t gather_chunk(std::size_t index, float floor,
                             std::vector<Candidate>& candidates) const;

    Lattice lattice_;
    Radii radii_;
    std::vector<std::vector<float>> radius_rows_;  // by level
    std::shared_ptr<const ResidentSet> resident_;
    std::vector<std::int32_t> slot_;     // by chunk of the set: into open_, or kNone
    std::vector<ChunkPriorities> open_;  // the first open_count_ are in use
    std::size_t open_count_ = 0;
};

}  // namespace terrane::internal
