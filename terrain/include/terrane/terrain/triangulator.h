// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace terrane {

/// Whether the mesh meets its target, and why not.
enum class MeshStatus {
    error_met,  ///< error_px is at most the target; its estimate, where the source is not certified
    budget_reached,  ///< limited by the triangle budget; see error_px
    finest_reached,  ///< limited by the lattice's finest spacing; see error_px
    not_resident,    ///< needed chunks are absent; no triangles: a root is absent
    invalid_view,    ///< the view was refused (NaN, field of view out of range): the last mesh
};

/// The enumerator's name, as programs print it.
const char* name_of(MeshStatus status);

/// The triangles that are drawn with the samples of one chunk.
struct MeshChunk {
    const Chunk* chunk = nullptr;   ///< whose samples the indices name
    std::uint32_t first_index = 0;  ///< into TerrainMesh::indices
    std::uint32_t index_count = 0;  ///< 3 a triangle
    /// [kChunkSamples^2] metres, added to the heights of the samples that the triangles use: morphing. Undefined
    /// at other samples; null if morphing is off. Chunks have the same bits at shared samples.
    const float* offsets = nullptr;

    /// Displayed world z of a sample: exact up to the rounding of one sum.
    double displayed_height(std::size_t sample, double quantum) const {
        const double height = quantum * static_cast<double>(chunk->heights[sample]);
        return offsets == nullptr ? height : height + static_cast<double>(offsets[sample]);
    }
};

/// The triangles of volumes over one chunk: they and those of its heightfield that they do not replace are drawn.
struct MeshSolid {
    /// Indices of three vertices each.
    using Triangles = std::span<const std::array<std::uint32_t, 3>>;
    const Chunk* chunk = nullptr;  ///< whose solid's vertices the indices name
    Triangles triangles;           ///< of one level of detail, counter-clockwise from outside
    /// For each side where the neighbour's volumes are not drawn: what closes the surface there.
    std::array<Triangles, 4> caps = {};

    /// Triangles of the chunk's solid surface in this frame.
    std::size_t triangle_count() const {
        std::size_t count = triangles.size();
        for (const Triangles& cap : caps) count += cap.size();
        return count;
    }
};

/// A frame's mesh: indices into the samples of resident chunks. A view of the triangulator's buffers, valid until
/// the next update().
struct TerrainMesh {
    std::shared_ptr<const ResidentSet> resident;  ///< keeps the chunks alive
    std::span<const MeshChunk> chunks;            ///< coarse to fine
    std::span<const std::uint16_t> indices;  ///< of samples; triangles counter-clockwise from above
    std::span<const MeshSolid> solids;       ///< in the order of the resident set
    std::size_t triangle_count = 0;          ///< of chunks and solids
    MeshStatus status = MeshStatus::not_resident;  ///< whether budget and error target are met
    /// Certified bound of the displayed surface's distance from the true surface, morphing included, for all ground
    /// points inside the view's side planes, in pixels of the picture's centre. Of the heightfield it is the vertical
    /// distance; of volumes, and where they replace the heightfield, the Euclidean one, both ways. Where volumes are
    /// not drawn, the heightfield closes over them, and what that hides counts. Infinite where the source is not
    /// certified (HeightSource::is_certified()).
    double error_px = 0.0;
    /// The same bound in two parts, for what is far from the eye: near it the detail below the lattice's finest spacing
    /// dominates error_px. At each of those points the distance is at most
    ///     refinable_error_px / pixels_per_radian() * distance from the eye + finest_error_m,
    /// distances being at least near_distance. At most error_px; infinite where error_px is.
    double refinable_error_px = 0.0;
    /// Largest certified error, metres, of the ground in view that is drawn at the finest spacing; 0 where none is.
    double finest_error_m = 0.0;
    /// Vertices with at most this priority, pixels, are not in the mesh; for CameraNeed::threshold_px.
    double threshold_px = 0.0;
    /// For those that share the budget: the least threshold whose demands have all been granted, at least threshold_px.
    double others_threshold_px = 0.0;
    std::size_t others_triangles = 0;  ///< of the demands that have been granted
    std::uint64_t refused_views = 0;   ///< since creation
};

/// Triangles of something else that is drawn in the same frame out of the same budget: objects, for instance. Ground
/// and others compete by one threshold: what has the larger screen error is refined first.
struct TriangleDemand {
    /// Drawn where the threshold is below this; may be infinite. One that is NaN or not above 0 is never granted.
    double threshold_px = 0.0;
    std::uint32_t triangles = 0;  ///< in addition to those with a larger threshold_px
};

/// Settings of a Triangulator. Fixed once it is created.
struct TriangulatorSettings {
    std::size_t triangle_budget = 100'000;  ///< hard limit; at least 2 for each root square
    double max_error_px = 1.0;              ///< refinement stops below this, > 0
    /// Vertices morph while their priority is between the threshold and this multiple of it, 1 to 16. A larger
    /// ratio moves the surface less from frame to frame and needs more triangles for the same error, which is up
    /// to 2 * morph_ratio / (morph_ratio + 1) thresholds. A priority that changes by a tenth moves its vertex by
    /// at most 0.2 * morph_ratio^2 / (morph_ratio^2 - 1) of its screen error: 0.49 at the default, all of it below
    /// 1.12. 1: no morphing, as for a single picture.
    double morph_ratio = kDefaultMorphRatio;
    int worker_count = 1;  ///< threads that update() runs on, its caller's included, 1 to 64
    /// Refined chunks that update() can process without allocating, 120 kB each; it grows if there are more.
    std::size_t open_chunks = 256;
};

/// Continuous level of detail over resident chunks, by longest-edge bisection.
///
/// Guarantees, checked by tests/terrain/lod/triangulator_test.cpp:
///   - never more than triangle_budget triangles;
///   - conforming: every inner edge belongs to exactly two triangles, whatever is resident;
///   - error_px is an upper bound on the screen error of the displayed surface, measured by brute force;
///   - vertices morph as the eye moves (see morph_ratio), and do not displace the surface when they appear;
///   - the same resident set, settings and view give the same bytes, whatever came before.
class Triangulator {
public:
    /// @param source  outlives the triangulator, which calls its interval() around the eye
    ///
    /// Fails: invalid_argument for settings out of range, a budget below 2 triangles for each root square among them
    static Result<Triangulator> create(const HeightSource& source,
                                       const TriangulatorSettings& settings);

    Triangulator(Triangulator&&) noexcept;
    Triangulator& operator=(Triangulator&&) noexcept;
    ~Triangulator();

    /// Computes the mesh of a view over the resident chunks.
    ///
    /// @param others in any order. The mesh and the demands that are granted (TerrainMesh::others_triangles) together
    ///               have at most triangle_budget triangles
    ///
    /// Threads:   one at a time
    /// Allocates: nothing, unless more chunks are refined than settings.open_chunks, or more are
    ///            resident than 16 times that, or there are more demands than in any call before
    /// Cost:      O(samples of the areas that the view refines)
    TerrainMesh update(std::shared_ptr<const ResidentSet> resident, const View& view,
                       std::span<const TriangleDemand> others = {});

private:
    struct State;
    explicit Triangulator(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
