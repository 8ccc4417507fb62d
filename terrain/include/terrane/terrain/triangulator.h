// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace terrane {

enum class MeshStatus {
    error_met,       ///< error_px is at most the target
    budget_reached,  ///< the triangle budget stopped refinement; error_px tells how far it got
    finest_reached,  ///< the lattice's finest spacing stopped refinement; so does error_px tell
    not_resident,    ///< wanted chunks are absent, or (no triangles) the roots have not arrived
    invalid_view,    ///< the view was refused (NaN, field of view out of range): last mesh kept
};

/// The enumerator's own name, as programs print it.
const char* name_of(MeshStatus status);

/// The triangles that are drawn with the samples of one chunk.
struct MeshChunk {
    const Chunk* chunk = nullptr;
    std::uint32_t first_index = 0;  ///< into TerrainMesh::indices
    std::uint32_t index_count = 0;  ///< 3 a triangle
    /// [kChunkSamples^2] metres added to the heights of the samples that the triangles use, for
    /// vertices that morph; undefined at other samples. Null where nothing of the chunk morphs.
    /// Chunks that share a sample have the same bits for it.
    const float* offsets = nullptr;

    /// World z of a sample as it is displayed: exact, up to the rounding of one sum.
    double displayed_height(std::size_t sample, double quantum) const {
        const double height = quantum * static_cast<double>(chunk->heights[sample]);
        return offsets == nullptr ? height : height + static_cast<double>(offsets[sample]);
    }
};

/// A frame's mesh: indices into the samples of resident chunks. A view of the triangulator's
/// buffers, valid until the next update().
struct TerrainMesh {
    std::shared_ptr<const ResidentSet> resident;  ///< keeps the chunks alive
    std::span<const MeshChunk> chunks;            ///< coarse to fine
    std::span<const std::uint16_t> indices;  ///< of samples; triangles counter-clockwise from above
    std::size_t triangle_count = 0;
    MeshStatus status = MeshStatus::not_resident;
    /// Certified, morphing included: no ground point inside the view's side planes is displayed further
    /// than this from the true surface, in pixels of the picture's centre.
    double error_px = 0.0;
    /// Vertices at or below this priority, in pixels, stayed out; what a pager should fetch for.
    double threshold_px = 0.0;
    std::uint64_t refused_views = 0;  ///< since creation
};

struct TriangulatorSettings {
    std::size_t triangle_budget = 100'000;  ///< hard limit; at least 2 for each root square
    double max_error_px = 1.0;              ///< refinement stops below this, > 0
    /// Vertices slide in while their priority rises from the threshold to this many times it, 1 to 16.
    /// Larger moves the surface less from frame to frame and needs more triangles for the same error: the
    /// displayed surface is off by up to 2 * morph_ratio / (morph_ratio + 1) thresholds. A priority that
    /// changes by a tenth moves its vertex by at most 0.2 * morph_ratio^2 / (morph_ratio^2 - 1) of its
    /// screen error: 0.49 at the default, all of it below 1.12. 1: vertices appear in place, as for a
    /// single picture.
    double morph_ratio = kDefaultMorphRatio;
    int worker_count = 1;  ///< threads that update() runs on, its caller's included, 1 to 64
    /// Chunks that update() has room for without allocating: 120 kB each. More are made room for once.
    std::size_t open_chunks = 256;
};

/// Continuous level of detail over resident chunks, by longest-edge bisection.
///
/// Guarantees, checked by tests/terrain/triangulator_test.cpp:
///   - never more than triangle_budget triangles;
///   - conforming: every inner edge belongs to exactly two triangles, whatever is resident;
///   - error_px is an upper bound on the screen error of the displayed surface, measured by brute force;
///   - vertices slide in and out as the eye moves (see morph_ratio), and stand flat when they appear;
///   - the same resident set, settings and view give the same bytes, whatever came before.
class Triangulator {
public:
    /// @param source  outlives the triangulator, which asks it for intervals around the eye
    ///
    /// Fails with invalid_argument where the budget is below 2 triangles for each root square, or
    /// the target is not > 0.
    static Result<Triangulator> create(const HeightSource& source,
                                       const TriangulatorSettings& settings);

    Triangulator(Triangulator&&) noexcept;
    Triangulator& operator=(Triangulator&&) noexcept;
    ~Triangulator();

    /// Makes the mesh of a view over what is resident.
    ///
    /// Threads:   one at a time
    /// Allocates: nothing, but where more chunks are refined than settings.open_chunks, or more are
    ///            resident than 16 times that
    /// Cost:      O(samples of the areas that the view refines)
    TerrainMesh update(std::shared_ptr<const ResidentSet> resident, const View& view);

private:
    struct State;
    explicit Triangulator(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
