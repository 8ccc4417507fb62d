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

/// Weights of attributes in the order of contractions of a ProgressiveMesh. A weight is the distance that a
/// difference of 1 costs, as a share of the diagonal of the mesh's bounding box: larger ones keep an attribute at the
/// expense of the shape. 0: not looked at. Range of each: 0 to 1e3.
struct ProgressiveSettings {
    double normal_weight = 0.01;             ///< of a component of a normal
    double texture_coordinate_weight = 0.1;  ///< of a texture coordinate
    double colour_weight = 0.02;             ///< of a colour between 0 and 1
    /// [positions] not 0: the vertex stays, and all others at its position. Empty: none.
    std::vector<std::uint8_t> locked = {};
    /// Recording ends at this number of triangles, which saves time where coarser levels are not needed.
    std::size_t least_triangle_count = 0;
};

/// A triangle mesh at every level of detail: a sequence of edge contractions that is played in both directions
/// (Hoppe, Progressive Meshes, SIGGRAPH 1996). A contraction moves all vertices of one position onto those of a
/// neighbouring one, so that every level is a list of triangles over the same vertices, with the attributes that they
/// had in the input; see docs/simplify.md.
///
/// Vertices with the same position are one place: where attributes jump between them is a seam. A place on a seam moves
/// along the seam only, both sides together, so that no level has a gap. Places where seams meet or end go last, when
/// nothing else is left; their triangles then have the nearest attributes at the place that they move to.
///
/// A connected component of at most 16 triangles may become an open sheet, of the triangles that face one way, and
/// then vanish, where that costs least: so that any count is reached. One triangle stays.
///
/// Vertices and triangles are in streaming order: those of a level are the first vertex_count() vertices and
/// the first triangle_count() triangles of the finest one, the latter with other indices.
///
/// Move-only. Reading one level from several threads at once is allowed; changing the level is for one thread.
class ProgressiveMesh {
public:
    using Triangle = TriangleMesh::Triangle;  ///< three indices of vertices()

    /// Contracts a mesh as far as can be, and records it. Begins at the finest level. Triangles whose corners are not
    /// at three different places are left out, and are no part of the surface that error_m() refers to.
    ///
    /// Fails:     invalid_argument where check() refuses the mesh, or a setting is out of its range
    /// Allocates: about 300 bytes a triangle while it runs; about 85 and the attributes stay
    /// Cost:      O(n log n)
    /// Accuracy:  the same bits with every compiler: `GoldenProgressive.IsTheSameWithEveryCompilerAtEveryLevel`
    static Result<ProgressiveMesh> create(const TriangleMesh& mesh,
                                          const ProgressiveSettings& settings = {});

    ProgressiveMesh(ProgressiveMesh&&) noexcept;
    ProgressiveMesh& operator=(ProgressiveMesh&&) noexcept;
    ~ProgressiveMesh();

    /// The same mesh with a level of its own, which begins at the level of this one. The record of contractions is
    /// shared and does not change, so that each may be used on a thread of its own.
    ///
    /// Allocates: 12 bytes a triangle of the finest level
    /// Cost:      of a copy of these
    ProgressiveMesh share() const;

    /// The vertices of all levels with their attributes, in streaming order; its triangles are those of the finest
    /// level.
    const TriangleMesh& finest() const;
    /// [vertices] which vertex of the input each is.
    std::span<const std::uint32_t> input_vertices() const;
    /// [triangles of the finest level] which triangle of the input each is: for materials of triangles.
    std::span<const std::uint32_t> input_triangles() const;

    /// Changes the level to the finest one with no more triangles than this, or to the coarsest.
    /// Cost: proportional to the contractions between the two levels, and O(log n). Allocates: nothing
    void set_triangle_count(std::size_t count);
    /// Changes the level to the coarsest one whose error_m() is no more than this; NaN or negative: to the finest.
    /// Cost: as set_triangle_count()
    void set_error(double error_m);

    /// The level's triangles, counter-clockwise from outside, metres of finest(). Valid until the level changes.
    std::span<const Triangle> triangles() const;
    /// How many vertices the level needs: the first ones.
    std::size_t vertex_count() const;
    /// Bound of the two-sided Hausdorff distance of the level to the input, metres: no point of either surface is
    /// farther than this from the other. Never less at a coarser level; 0 at the finest.
    /// `ProgressiveMesh.ErrorIsNotBelowTheMeasuredDistance` measures it.
    double error_m() const;
    /// Triangles of the coarsest level: 0 only where the input has none.
    std::size_t least_triangle_count() const;

    /// [contractions + 1] error_m() of all levels, from the finest to the coarsest.
    std::span<const double> step_errors_m() const;
    /// [contractions + 1] triangles of the same levels; they decrease.
    std::span<const std::uint32_t> step_triangle_counts() const;

    /// Where the level's vertices are at a coarser level: vertex i of the level becomes the answer's vertex i. The
    /// surface with every position and attribute at `(1 - t) * vertex + t * target` is the present level at t = 0 and
    /// the coarser one at t = 1, and moves continuously between them: draw the present triangles (a geomorph). Where a
    /// body becomes a sheet or vanishes between the two levels, its other triangles are there until t = 1.
    ///
    /// @param coarser_count triangles, as set_triangle_count(); more than the level's: no vertex moves
    /// Cost: O(vertex_count()) and the contractions between
    std::vector<std::uint32_t> geomorph_targets(std::size_t coarser_count) const;

private:
    struct State;
    explicit ProgressiveMesh(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
