// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"
#include "lod/keys/screen_error.h"
#include "lod/pins/solid_pins.h"
#include "lod/selection/selection.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Keys of all vertices that may be below a floor, for one view of one resident set.
///
/// A key is raised to the keys of the vertex's parents, and infinite if a parent is not resident: so every set of
/// vertices below a threshold is closed under parents, and its mesh conforms. Every vertex has one key, stored in the
/// chunk that contains it not on its eastern or northern side.
class VertexKeys {
public:
    /// @param open_chunks  initial capacity
    VertexKeys(const HeightSource& source, SimdLevel simd, std::size_t open_chunks);

    /// Opens every chunk that may have a vertex below the floor, and computes keys from the roots down. Root chunks are
    /// always open.
    ///
    /// Allocates: only when more chunks are open, or resident, than ever before
    ///
    /// @param pins       outlive the answers
    /// @param selection  begun; every open chunk is added to it
    void compute(const ResidentSet& resident, const ScreenError& screen, const SolidPins& pins,
                 float floor, Selection& selection, WorkerTeam& team);

    /// Coarse to fine, in the order of the resident set.
    std::span<OpenChunk* const> open() const { return {open_.data(), open_count_}; }
    /// The open chunk of an index in the resident set; null where it is not open.
    OpenChunk* find(std::int32_t index) const;

    /// Keys before they are raised to the parents': of an area,
    /// @param keys_out [AreaVertices::kSquares]
    void own_keys(const OpenChunk& chunk, int area, AreaVertices::Kind kind, float* keys_out) const;
    /// of the i-th midpoint on the eastern or northern side,
    float own_side_key(const OpenChunk& chunk, Side side, int i) const;
    /// and of a root's vertex of a coarser spacing. Column and row count its even samples.
    float own_coarse_key(const ScreenError& screen, const OpenChunk& root, int column,
                         int row) const;

    /// Lower bound of the own keys of a chunk's vertices.
    float least_key(const ScreenError& screen, const OpenChunk& chunk) const {
        return screen.least_key(reach_of(screen, *chunk.chunk), chunk.chunk->max_vertex_bound);
    }
    /// Encloses the reaches of a chunk's vertices, without the coarser ones of a root.
    ScreenError::WorldBox reach_of(const ScreenError& screen, const Chunk& chunk) const {
        return screen.reach_of(chunk, reach(chunk, 1, true).half_width);
    }

    const KeyKernels& kernels() const { return *kernels_; }
    const Lattice& lattice() const { return lattice_; }

private:
    Reach reach(const Chunk& chunk, int stride, bool is_centre) const;
    float own_key(const OpenChunk& chunk, int column, int row, float low, float high,
                  float half_width, float inverse_square_bound) const;
    void open_chunk(const ResidentSet& resident, std::size_t index);
    void link(const ResidentSet& resident, OpenChunk& chunk);
    void open_areas(const ScreenError& screen, float floor, OpenChunk& chunk) const;
    void find_centres(float floor, OpenChunk& chunk, int area) const;
    void find_midpoints(float floor, OpenChunk& chunk, int area) const;
    void fetch_kinds(const OpenChunk& chunk, int area, std::size_t first, std::size_t last) const;
    void find_centres(float floor, OpenChunk& chunk) const;
    void find_midpoints(float floor, OpenChunk& chunk) const;
    void find_sides(float floor, OpenChunk& chunk) const;

    bool may_be_below(const ScreenError& screen, const OpenChunk& root, int stride,
                      float floor) const;
    void find_coarse_keys(const ScreenError& screen, float floor,
                          std::span<OpenChunk* const> roots) const;
    void trim_coarse_centres(OpenChunk& root, int stride, float floor) const;
    void trim_coarse_midpoints(OpenChunk& root, int stride, float floor) const;

    Lattice lattice_;
    Reaches reaches_;
    const KeyKernels* kernels_;
    const SolidPins* pins_ = nullptr;  // of the frame
    std::vector<std::unique_ptr<OpenChunk>> pool_;
    std::vector<OpenChunk*> open_;
    std::size_t open_count_ = 0;
    std::vector<OpenChunk*> by_index_;  // in the resident set
};

}  // namespace terrane::internal
