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

/// Whether the mesh meets its target and, if not, why.
enum class MeshStatus {
    /// error_px, or its estimate if the source is not certified, is at most max_error_px.
    error_met,
    budget_reached,  ///< limited by the triangle budget; see error_px
    finest_reached,  ///< limited by the lattice's finest spacing; see error_px
    not_resident,  ///< needed chunks are not resident; without all root squares there are no triangles
    invalid_view,  ///< the view was refused (NaN, field of view out of range); the mesh is the previous one
};

/// The enumerator's name, as programs print it.
const char* name_of(MeshStatus status);

/// The triangles that are drawn with the samples of one chunk.
struct MeshChunk {
    const Chunk* chunk = nullptr;   ///< chunk whose samples the indices refer to
    std::uint32_t first_index = 0;  ///< into TerrainMesh::indices
    std::uint32_t index_count = 0;  ///< three per triangle
    /// [kChunkSamples^2] morph offsets in metres, added to the heights of the samples that the triangles use. Undefined
    /// at other samples; null if morphing is off. Offsets of samples that chunks share are bit-identical.
    const float* offsets = nullptr;

    /// Displayed world z of a sample, with the rounding error of one addition.
    double displayed_height(std::size_t sample, double quantum) const {
        const double height = quantum * static_cast<double>(chunk->heights[sample]);
        return offsets == nullptr ? height : height + static_cast<double>(offsets[sample]);
    }
};

/// Triangles of the volumes over one chunk, drawn with those heightfield triangles of the chunk that they do not
/// replace.
struct MeshSolid {
    /// Indices of three vertices each.
    using Triangles = std::span<const std::array<std::uint32_t, 3>>;
    const Chunk* chunk = nullptr;  ///< chunk whose solid the vertex indices refer to
    Triangles triangles;           ///< of one level of detail, counter-clockwise from outside
    /// For each side where the neighbour's volumes are not drawn: the triangles that close the surface there.
    std::array<Triangles, 4> caps = {};

    /// Triangles of the chunk's solid surface in this frame.
    std::size_t triangle_count() const {
        std::size_t count = triangles.size();
        for (const Triangles& cap : caps) count += cap.size();
        return count;
    }
};

/// Triangles that are on a device: see GpuTriangulator in terrane::render.
struct DeviceMesh;

/// The mesh of one frame: indices of samples of the resident chunks. References the triangulator's buffers; valid until
/// the next update().
struct TerrainMesh {
    std::shared_ptr<const ResidentSet> resident;  ///< keeps the chunks alive
    std::span<const MeshChunk> chunks;            ///< coarse to fine
    std::span<const std::uint16_t> indices;  ///< of samples; triangles counter-clockwise from above
    /// Not null: the triangles are there, in place of `chunks` and `indices`.
    const DeviceMesh* device = nullptr;
    std::span<const MeshSolid> solids;             ///< in the order of the resident set
    std::size_t triangle_count = 0;                ///< of chunks and solids
    MeshStatus status = MeshStatus::not_resident;  ///< whether budget and error target are met
    /// Certified bound of the distance between the displayed surface, morphing included, and the true surface, over all
    /// ground points inside the view's side planes, in pixels of the picture's centre. For the heightfield the distance
    /// is vertical; for volumes, and where they replace the heightfield, it is the two-sided Euclidean distance. Where
    /// volumes are not drawn, the heightfield closes over them, and the bound includes what it hides. Infinite if the
    /// source is not certified (HeightSource::is_certified()).
    double error_px = 0.0;
    /// A bound in two parts, tighter than error_px far from the eye: error_px is dominated by the ground near the eye,
    /// where detail below the finest spacing is missing. At each point for which error_px holds, the two surfaces are
    /// at most
    ///     refinable_error_px / pixels_per_radian() * max(distance from the eye, near_distance) + finest_error_m
    /// apart. refinable_error_px is at most error_px, and infinite if error_px is.
    double refinable_error_px = 0.0;
    /// Largest certified error, metres, of the ground in view that is drawn at the finest spacing; 0 if there is none.
    double finest_error_m = 0.0;
    /// Vertices whose priority is at most this, pixels, are not in the mesh. Pass it on as CameraNeed::threshold_px.
    double threshold_px = 0.0;
    /// All demands with a TriangleDemand::threshold_px above this are granted. This is at least threshold_px.
    double demand_threshold_px = 0.0;
    std::size_t demand_triangles = 0;  ///< triangles of the granted demands
    std::uint64_t refused_views = 0;   ///< number of refused views since creation
};

/// Triangles that another renderer, for example of objects, demands from the frame's budget. Ground and demands compete
/// by one threshold: whatever has the larger screen error is refined first.
struct TriangleDemand {
    /// The triangles are drawn if the threshold is below this; may be infinite. NaN, 0 and negative values are never
    /// granted.
    double threshold_px = 0.0;
    std::uint32_t triangles = 0;  ///< in addition to those of demands with a larger threshold_px
};

/// Settings of a Triangulator. Fixed once it is created.
struct TriangulatorSettings {
    std::size_t triangle_budget = 100'000;  ///< hard limit; at least 2 per root square
    double max_error_px = 1.0;              ///< pixels, > 0; refinement stops at this error
    /// A vertex morphs while its priority is between the threshold and this multiple of it, 1 to 16. A larger ratio
    /// moves the surface less from frame to frame, but needs more triangles for the same error. The error is up to 2 *
    /// morph_ratio / (morph_ratio + 1) thresholds. If a priority changes by a tenth, its vertex moves by at most 0.2 *
    /// morph_ratio^2 / (morph_ratio^2 - 1) of its screen error: by 0.49 of it at the default ratio, by all of it below
    /// a ratio of 1.12. 1: no morphing, as for a single picture.
    double morph_ratio = kDefaultMorphRatio;
    int worker_count = 1;  ///< threads that update() uses, including its caller's, 1 to 64
    /// Refined chunks that update() can process without allocating, 120 kB each; grows if a view refines more.
    std::size_t open_chunks = 256;
};

/// Continuous level of detail over resident chunks, by longest-edge bisection.
///
/// Guarantees, checked by tests/terrain/lod/triangulator_test.cpp:
///   - never more than triangle_budget triangles;
///   - conforming: every inner edge belongs to exactly two triangles, whatever is resident;
///   - error_px is an upper bound on the screen error of the displayed surface, measured by brute force;
///   - vertices morph as the eye moves (see morph_ratio); a vertex that becomes active does not displace the surface;
///   - the same resident set, settings and view give the same bytes, regardless of earlier calls.
class Triangulator {
public:
    /// @param source must outlive the triangulator, which calls its interval() around the eye
    ///
    /// Fails: invalid_argument for settings out of range, including a budget below 2 triangles per root square
    static Result<Triangulator> create(const HeightSource& source,
                                       const TriangulatorSettings& settings);

    Triangulator(Triangulator&&) noexcept;
    Triangulator& operator=(Triangulator&&) noexcept;
    ~Triangulator();

    /// Computes the mesh of a view over the resident chunks.
    ///
    /// @param others in any order. The mesh and the granted demands (TerrainMesh::demand_triangles) together have at
    ///               most triangle_budget triangles
    ///
    /// Threads:   one at a time
    /// Allocates: nothing, unless more chunks are refined than settings.open_chunks, more than 16 times that are
    ///            resident, or more demands are given than in any earlier call
    /// Cost:      O(samples of the areas that the view refines)
    TerrainMesh update(std::shared_ptr<const ResidentSet> resident, const View& view,
                       std::span<const TriangleDemand> others = {});

private:
    struct State;
    explicit Triangulator(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
