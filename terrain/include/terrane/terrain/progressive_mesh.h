// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Weights of attributes in the cost of a contraction. A weight is the distance that counts as much as a difference of
/// 1, relative to the diagonal of the mesh's bounding box: larger weights preserve an attribute at the expense of the
/// shape. Each is 0 to 1e3; at 0 the attribute is ignored. No weights suit all meshes: a texture may be repeated any
/// number of times across a mesh, and colours may be data that only a shader reads.
struct ProgressiveSettings {
    double normal_weight = 0.01;             ///< of a normal's component
    double texture_coordinate_weight = 0.1;  ///< of a texture coordinate
    double colour_weight = 0.02;             ///< of a colour component between 0 and 1
    /// [positions] nonzero: the vertex is kept, as are all others at its position. Empty: no vertex is locked.
    std::vector<std::uint8_t> locked = {};
    /// Recording ends at this number of triangles; saves time if coarser levels are not needed.
    std::size_t least_triangle_count = 0;
    /// Whether recording ends where only contractions that move seams, or places where seams meet, are left: then no
    /// triangle has corners of two charts or of two materials.
    bool keeps_seams = false;
};

/// A triangle mesh at every level of detail: a sequence of edge contractions that can be applied and undone (Hoppe,
/// Progressive Meshes, SIGGRAPH 1996). A contraction moves all vertices at one position onto the vertices at a
/// neighbouring position. Every level is therefore a list of triangles over the input's vertices, with their
/// attributes; see docs/simplify.md.
///
/// Vertices with the same position form one place; edges where their attributes jump form seams. A place on a seam
/// moves only along the seam, on both sides at once, so that no level has a gap. Places where seams meet or end are
/// contracted last, when nothing else is left; their triangles then get the nearest attributes at the target place
/// (ProgressiveSettings::keeps_seams omits this). Materials are an attribute without a weight.
///
/// A component of at most 16 triangles may be reduced to an open sheet (its triangles that face one way) and then
/// vanish, if that costs least. Without keeps_seams any triangle count can therefore be reached; one triangle is kept.
///
/// Vertices and triangles are in streaming order: a level uses the first vertex_count() vertices and the first
/// triangles().size() triangles of the finest level, the triangles with vertex indices of its own.
///
/// Move-only. Several threads may read one level at once; changing the level is for one thread.
class ProgressiveMesh {
public:
    using Triangle = TriangleMesh::Triangle;  ///< three indices of vertices()

    /// Contracts a mesh as far as possible and records the contractions. The result is at its finest level. Triangles
    /// whose corners are not at three different positions are dropped; error_m() does not refer to them.
    ///
    /// Fails:     invalid_argument if validate() refuses the mesh, or for a setting out of range
    /// Allocates: about 300 bytes per triangle while it runs; about 85 and the attributes remain
    /// Cost:      O(n log n)
    /// Accuracy:  the same bits with every compiler: `GoldenProgressive.IsTheSameWithEveryCompilerAtEveryLevel`
    static Result<ProgressiveMesh> create(const TriangleMesh& mesh,
                                          const ProgressiveSettings& settings = {});

    ProgressiveMesh(ProgressiveMesh&&) noexcept;
    ProgressiveMesh& operator=(ProgressiveMesh&&) noexcept;
    ~ProgressiveMesh();

    /// A mesh that shares the record of contractions and has its own level, initially this mesh's level. The record
    /// never changes, so each mesh may be used on a different thread.
    ///
    /// Allocates: 12 bytes per triangle of the finest level
    /// Cost:      copies these bytes
    ProgressiveMesh share() const;

    /// The vertices of all levels with their attributes, in streaming order, and the triangles of the finest level.
    const TriangleMesh& finest() const;
    /// [vertices] input index of each vertex.
    std::span<const std::uint32_t> input_vertices() const;
    /// [triangles of the finest level] input index of each triangle, for materials of triangles.
    std::span<const std::uint32_t> input_triangles() const;

    /// Changes the level to the finest one with at most this number of triangles, or to the coarsest.
    /// Cost: O(log n), plus the contractions between the two levels. Allocates: nothing
    void set_triangle_count(std::size_t count);
    /// Changes the level to the coarsest one whose error_m() is at most `error_m`; NaN or negative: to the finest.
    /// Cost: as set_triangle_count()
    void set_error(double error_m);

    /// The level's triangles as indices of finest(), counter-clockwise from outside. Valid until the level changes.
    std::span<const Triangle> triangles() const;
    /// Number of vertices that the level uses: the first ones.
    std::size_t vertex_count() const;
    /// Bound of the two-sided Hausdorff distance between the level and the input, metres: no point of either surface is
    /// farther than this from the other surface. Does not decrease towards coarser levels; 0 at the finest.
    /// `ProgressiveMesh.ErrorIsNotBelowTheMeasuredDistance` measures it.
    double error_m() const;
    /// Triangle count of the coarsest level: 0 only if the input has no triangles.
    std::size_t least_triangle_count() const;

    /// [contractions + 1] error_m() of all levels, from the finest to the coarsest.
    std::span<const double> step_errors_m() const;
    /// [contractions + 1] triangle counts of the same levels; decreasing.
    std::span<const std::uint32_t> step_triangle_counts() const;

    /// Positions of the level's vertices at a coarser level: vertex i becomes the returned vertex i. The surface with
    /// every position and attribute at `(1 - t) * vertex + t * target` is the current level at t = 0 and the coarser
    /// one at t = 1, and moves continuously in between: draw the current triangles (a geomorph). If a component becomes
    /// a sheet or vanishes between the two levels, its other triangles remain until t = 1.
    ///
    /// @param coarser_count triangle count, as for set_triangle_count(); if above the level's count, no vertex moves
    /// Cost: O(vertex_count()), plus the contractions between the levels
    std::vector<std::uint32_t> geomorph_targets(std::size_t coarser_count) const;

private:
    struct State;
    explicit ProgressiveMesh(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
