// SPDX-License-Identifier: MIT
#pragma once

#include "key_kernels.h"
#include "open_chunk.h"
#include "screen_error.h"
#include "worker_team.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Keys of all vertices that may be below a floor, for one view of one resident set.
///
/// A vertex has at least the key of its parents, and none where a parent is not resident: so every set
/// of vertices below a threshold is closed under parents, and its mesh conforms.
class VertexKeys {
public:
    /// @param open_chunks  room is made for so many at once
    VertexKeys(const HeightSource& source, SimdLevel simd, std::size_t open_chunks);

    /// Opens every chunk that may have a vertex below the floor, and raises keys to those of the
    /// parents from the roots down. Root chunks are always open.
    ///
    /// Allocates: only where more chunks are open, or resident, than there was room for
    void compute(const ResidentSet& resident, const ScreenError& screen, float floor,
                 WorkerTeam& team);

    /// Coarse to fine, in the order of the resident set.
    std::span<OpenChunk* const> open() const { return {open_.data(), open_count_}; }

    /// Keys of a chunk's vertices from their own bounds and distances, in its open areas.
    /// @param keys_out [OpenChunk::kSamples]
    void compute_own(const ScreenError& screen, const OpenChunk& chunk, float* keys_out) const;

    /// No vertex of an open chunk has a smaller key of its own.
    float least_key(const ScreenError& screen, const OpenChunk& chunk) const {
        return screen.least_key(screen.box_of(*chunk.chunk), chunk.chunk->max_vertex_bound,
                                largest_reach(*chunk.chunk));
    }

    /// Of a chunk's own vertices.
    Reach largest_reach(const Chunk& chunk) const;

    const KeyKernels& kernels() const { return *kernels_; }
    const Lattice& lattice() const { return lattice_; }

    /// Spacing of the coarsest vertices that a chunk owns, in its own samples.
    static int coarsest_stride(const Chunk& chunk) {
        return chunk.key.level == 0 ? kChunkCells / 2 : 1;
    }

private:
    struct ReachRow {
        std::array<float, kChunkSamples> across, up;
    };
    std::size_t exponent(int level, int stride) const;
    const ReachRow& reach_row(int level, int row) const;
    OpenChunk* find(std::int32_t index) const;
    void open_chunk(const ResidentSet& resident, std::size_t index);
    void link(const ResidentSet& resident, OpenChunk& chunk);
    void open_areas(const ScreenError& screen, float floor, OpenChunk& chunk) const;
    void compute_own_row(const ScreenError& screen, const ScreenError::Axes& axes,
                         const OpenChunk& chunk, int row, int first, int last, bool is_in_view,
                         float* keys_out) const;
    void fade_inside(OpenChunk& chunk) const;
    void trim_inside(OpenChunk& chunk, float floor) const;
    void trim_borders(OpenChunk& chunk, float floor) const;
    void trim_root_centres(OpenChunk& root, int stride, float floor) const;
    void trim_root_midpoints(OpenChunk& root, int stride, float floor) const;
    void trim_border_midpoint(OpenChunk& chunk, Side side, std::size_t sample, std::size_t inside,
                              std::size_t across, float floor) const;

    Lattice lattice_;
    Reaches reaches_;
    const KeyKernels* kernels_;
    std::vector<std::vector<ReachRow>> reach_rows_;  // by level
    std::vector<std::unique_ptr<OpenChunk>> pool_;
    std::vector<OpenChunk*> open_;
    std::size_t open_count_ = 0;
    std::vector<OpenChunk*> by_index_;  // of the resident set
};

}  // namespace terrane::internal
