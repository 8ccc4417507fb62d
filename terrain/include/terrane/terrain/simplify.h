// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane {

/// A triangle mesh to simplify, as views of the caller's arrays.
struct SimplifyInput {
    /// Positions in any frame, metres; finite, no coordinate beyond 2^38 m.
    std::span<const Eigen::Vector3d> vertices = {};
    /// Indices of three different vertices. Adjacent triangles share indices: vertices with equal positions and
    /// different indices are different vertices, with a border between them.
    std::span<const std::array<std::uint32_t, 3>> triangles = {};
    /// [vertices] nonzero: the vertex is kept. Empty: no vertex is locked.
    std::span<const std::uint8_t> locked = {};
    /// Whether a contraction may create an edge between two locked vertices. Set to false if another mesh shares these
    /// vertices and may have that edge too.
    bool may_join_locked = true;
};

/// Limits of one level. The level ends at the first limit that is reached, or when no contraction is left.
struct SimplifyLevel {
    std::size_t triangles = 0;  ///< the level ends when it has at most this many
    /// Largest Hausdorff distance from the input, metres, >= 0. Even to simplify flat parts it must be above 0, because
    /// of rounding: see SimplifiedMesh::error_m.
    double error_m = std::numeric_limits<double>::infinity();
};

/// Why a level ended.
enum class SimplifyStop : std::uint8_t {
    triangle_count,  ///< SimplifyLevel::triangles is reached
    error_limit,     ///< SimplifyLevel::error_m is reached; a larger limit allows fewer triangles
    no_contraction,  ///< all remaining vertices are locked, or needed for shape or topology
};

/// One level: triangles over a subset of the input's vertices.
struct SimplifiedMesh {
    /// Indices of the input's vertices, with the input's winding, in the order of the input triangles that they come
    /// from.
    std::vector<std::array<std::uint32_t, 3>> triangles = {};
    /// Certified bound of the two-sided Hausdorff distance to the input, metres: no point of either surface is farther
    /// than this from the other surface. 0 if nothing was contracted; otherwise rounding adds about 1e-13 of an edge's
    /// length per contraction.
    double error_m = 0.0;
    SimplifyStop stop = SimplifyStop::triangle_count;  ///< why it does not have fewer triangles
};

/// Simplifies a mesh to several levels in one run, by half-edge contractions in the order of their quadric errors. A
/// contraction moves a vertex onto a neighbour. Every level therefore uses the input's vertices, and one vertex buffer
/// serves all levels. See docs/simplify.md for the certificate.
///
/// Vertices are kept if they are locked, have more than 48 triangles, or have triangles that do not form one disk or
/// half disk (non-manifold, inconsistent winding). A vertex on a border moves along the border only. A contraction is
/// refused if it would flip a triangle, identify two edges or triangles, or make a triangle with a height below 1/50 of
/// its longest edge, unless that triangle replaces a worse one. Closed surfaces stay closed, manifold ones manifold.
///
///
/// @param input  may be empty, have borders, non-manifold edges, triangles without area and unused vertices
/// @param levels each level starts where the previous one ended; errors do not decrease
/// @return       [levels]
///
/// Fails:     invalid_argument, naming the first vertex, triangle or level that is not as described above
/// Threads:   any number of calls at once
/// Allocates: about 150 bytes per vertex and 105 per triangle, freed before it returns, and the result
/// Cost:      O(n log n)
/// Accuracy:  the same bits with every compiler. `Simplify.BoundIsNotBelowTheMeasuredDistance` measures the bound
Result<std::vector<SimplifiedMesh>> simplify(const SimplifyInput& input,
                                             std::span<const SimplifyLevel> levels);

}  // namespace terrane
