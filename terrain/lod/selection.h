// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "lod/key_kernels.h"
#include "lod/screen_error.h"
#include "lod/solid_pins.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// A key and its number of triangles.
struct WeightedKey {
    float key = 0.0f;
    std::uint32_t weight = 0;
};

/// Finds the threshold at which a budget is used up: an exact order statistic of the keys of all open vertices and of
/// the other demands on the budget.
///
/// The weight of a vertex is the number of triangles it adds: 2 inside the world, 1 on its border.
class Selection {
public:
    explicit Selection(int worker_count);

    /// Sets the keys of the other demands for all following searches.
    ///
    /// Allocates: nothing if there were as many before
    void set_others(std::span<const WeightedKey> others);

    /// Begins a search. The caller then adds each key of each open chunk once: KeyKernels add an area's keys to the
    /// window() of their worker, add_others() adds all other keys.
    ///
    /// @param guess  expected threshold, 0 if unknown; affects only the running time
    void begin(float floor, float guess);
    /// The window of a worker, with capacity for the keys of a chunk.
    KeyWindow& window(int worker);
    /// Adds the keys of midpoints on the world's border and of a root's vertices of coarser spacings.
    void add_others(const OpenChunk& chunk, int worker);

    /// An area's vertices of one kind as candidates.
    static AreaPlace place_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind);

    /// The largest threshold, at most the floor, such that all vertices with smaller keys weigh at most `budget`.
    /// Vertices with equal keys are selected together. Sets the bits of the active vertices, whose keys are below the
    /// threshold.
    float find(std::span<OpenChunk* const> open, const KeyKernels& kernels, std::size_t budget,
               WorkerTeam& team);

private:
    // Counts of one worker
    struct Tally {
        std::vector<KeyCandidate> candidates;
        KeyWindow window;
        bool is_full = false;
        std::span<const KeyCandidate> inside() const { return {candidates.data(), window.count}; }
    };
    void count_chunk(OpenChunk& chunk, const KeyKernels& kernels, int worker);
    void open_windows(float low, float high);
    std::size_t count(std::span<OpenChunk* const> open, const KeyKernels& kernels, float low,
                      float high, WorkerTeam& team);
    std::size_t below() const;
    std::size_t others_below(float key) const;
    std::span<const WeightedKey> others_inside() const;

    float search(std::span<OpenChunk* const> open, const KeyKernels& kernels, std::size_t budget,
                 WorkerTeam& team);
    float pick(float low, float high, std::size_t used, std::size_t budget);

    float floor_ = 0.0f;
    float low_ = 0.0f, high_ = 0.0f;                // the first window
    float window_low_ = 0.0f, window_high_ = 0.0f;  // the current window
    std::vector<Tally> tallies_;
    std::vector<WeightedKey> others_;         // ascending
    std::vector<std::size_t> others_weight_;  // [others_ + 1] prefix sums of their weights
    std::vector<WeightedKey> candidates_;
    std::array<std::size_t, 1024> bins_{};
};

/// Keys of all vertices whose keys may be below a floor, for one view of one resident set.
///
/// A key is raised to the keys of the vertex's parents, and is infinite if a parent is not resident. Therefore every
/// set of vertices below a threshold is closed under parents, and its mesh is conforming. Every vertex has one key: the
/// key of a vertex between two chunks is stored in the eastern or northern one.
class VertexKeys {
public:
    /// @param open_chunks  initial capacity
    VertexKeys(const HeightSource& source, SimdLevel simd, std::size_t open_chunks);

    /// Opens every chunk that may have a vertex below the floor, and computes keys from the roots down. Root chunks are
    /// always open.
    ///
    /// Allocates: only if more chunks are open or resident than ever before
    ///
    /// @param pins       must outlive the results
    /// @param selection  after begin(); every open chunk is added to it
    void compute(const ResidentSet& resident, const ScreenError& screen, const SolidPins& pins,
                 float floor, Selection& selection, WorkerTeam& team);

    /// Open chunks from coarse to fine, in the order of the resident set.
    std::span<OpenChunk* const> open() const { return {open_.data(), open_count_}; }
    /// The chunk at an index of the resident set, if it is open; else null. kNone gives null.
    OpenChunk* find(std::int32_t index) const;

    /// *Own keys* of an area: keys before they are raised to the parents' keys.
    /// @param keys_out [AreaVertices::kSquares]
    void own_keys(const OpenChunk& chunk, int area, AreaVertices::Kind kind, float* keys_out) const;
    /// Own key of the i-th midpoint on the eastern or northern side.
    float own_side_key(const OpenChunk& chunk, Side side, int i) const;
    /// Own key of a root's vertex of a coarser spacing. Column and row count even samples.
    float own_coarse_key(const ScreenError& screen, const OpenChunk& root, int column,
                         int row) const;

    /// Box of the reaches of a chunk's vertices, excluding a root's vertices of coarser spacings.
    ScreenError::WorldBox reach_of(const ScreenError& screen, const Chunk& chunk) const {
        return screen.reach_of(chunk, reach(chunk, 1, true).half_width);
    }

    const KeyKernels& kernels() const { return *kernels_; }
    const Lattice& lattice() const { return lattice_; }
    const Reaches& reaches() const { return reaches_; }

private:
    Reach reach(const Chunk& chunk, int stride, bool is_centre) const;
    float own_key(const OpenChunk& chunk, int column, int row, float low, float high,
                  float half_width, float inverse_square_bound) const;
    void open_chunk(const ResidentSet& resident, std::size_t index);
    void link(const ResidentSet& resident, OpenChunk& chunk);
    static void place(const ScreenError& screen, OpenChunk& chunk);
    void open_areas(const ScreenError& screen, float floor, OpenChunk& chunk) const;
    using Limits = std::array<float, AreaVertices::kSquares>;
    const float* limits_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind,
                           Limits& limits_out) const;
    OwnKeys own_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind) const;
    void find_centres(float floor, OpenChunk& chunk, int area, KeyWindow& window) const;
    void find_midpoints(float floor, OpenChunk& chunk, int area, KeyWindow& window) const;
    void fetch_kinds(const OpenChunk& chunk, int area, std::size_t first, std::size_t last) const;
    void find_centres(float floor, OpenChunk& chunk, KeyWindow& window) const;
    void find_midpoints(float floor, OpenChunk& chunk, KeyWindow& window) const;
    void find_sides(float floor, OpenChunk& chunk) const;

    bool may_be_below(const ScreenError& screen, const OpenChunk& root, int stride,
                      float floor) const;
    void find_coarse_keys(const ScreenError& screen, float floor,
                          std::span<OpenChunk* const> roots) const;
    void find_coarse_keys(const ScreenError& screen, OpenChunk& root, int stride, bool is_centre,
                          float floor) const;
    void own_coarse_keys(const ScreenError& screen, const OpenChunk& root, int stride,
                         bool is_centre, std::span<const std::size_t> vertices,
                         float* keys_out) const;

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
