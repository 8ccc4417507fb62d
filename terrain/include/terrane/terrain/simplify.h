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
    /// Positions in any one frame, metres; finite, no coordinate beyond 2^38 m.
    std::span<const Eigen::Vector3d> vertices = {};
    /// Indices of three different vertices. Neighbours share indices: equal positions with different indices are
    /// different vertices, with a border between them.
    std::span<const std::array<std::uint32_t, 3>> triangles = {};
    /// [vertices] not 0: the vertex stays. Empty: none.
    std::span<const std::uint8_t> locked = {};
    /// Whether an edge may be made between two locked vertices. False where another mesh shares them and may have that
    /// edge too.
    bool may_join_locked = true;
};

/// Where a level ends: at the first of its two limits, or where no contraction is left.
struct SimplifyLevel {
    std::size_t triangles = 0;  ///< the level ends as soon as it has no more than these
    /// Largest Hausdorff distance from the input, metres, >= 0. Flat parts need a little too: see
    /// SimplifiedMesh::error_m.
    double error_m = std::numeric_limits<double>::infinity();
};

/// What a level ended at.
enum class SimplifyStop : std::uint8_t {
    triangle_count,  ///< SimplifyLevel::triangles
    error_limit,     ///< more triangles could go with a larger SimplifyLevel::error_m
    no_contraction,  ///< no vertex can go whatever the error: locked, or needed for shape or topology
};

/// One level: a subset of the input's vertices, and triangles of them.
struct SimplifiedMesh {
    /// Indices of the input's vertices, wound as the input. In the order of the input's triangles that they come from.
    std::vector<std::array<std::uint32_t, 3>> triangles = {};
    /// Certified bound of the two-sided Hausdorff distance to the input, metres: no point of either surface is farther
    /// than this from the other. 0 where nothing was contracted; else rounding adds of the order of 1e-13 of an
    /// edge's length for each contraction.
    double error_m = 0.0;
    SimplifyStop stop = SimplifyStop::triangle_count;  ///< why it has no fewer triangles
};

/// Simplifies a mesh by half-edge contractions in the order of their quadric errors, to several levels in one run. A
/// contraction moves a vertex onto a neighbour, so that every level uses vertices of the input: one buffer of vertices
/// serves all levels. See docs/simplify.md for the certificate.
///
/// What stays: locked vertices; vertices whose triangles are not one disk or half disk (non-manifold, or wound against
/// each other), or are more than 48. A vertex of a border moves along the border only. Contractions that would turn
/// a triangle
/// over, identify two edges or triangles, or make a triangle whose height is below 1/50 of its longest edge are
/// refused, unless a triangle that they replace is worse. Closed surfaces stay closed, manifold ones manifold.
///
/// @param input  may be empty, have borders, non-manifold edges, triangles without area and unused vertices
/// @param levels each begins where the one before ended; their errors do not decrease
/// @return       [levels]
///
/// Fails:     invalid_argument, naming the first vertex, triangle or level that is not as described above
/// Threads:   any number of calls at once
/// Allocates: about 150 bytes a vertex and 105 a triangle, given back before it returns, and the result
/// Cost:      O(n log n)
/// Accuracy:  the same bits with every compiler. `Simplify.BoundIsNotBelowTheMeasuredDistance` measures the bound
Result<std::vector<SimplifiedMesh>> simplify(const SimplifyInput& input,
                                             std::span<const SimplifyLevel> levels);

}  // namespace terrane
