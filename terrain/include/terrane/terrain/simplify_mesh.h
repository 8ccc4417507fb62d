// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/simplify.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane {

/// How simplify_mesh() reduces triangles; see docs/simplify.md.
enum class SimplifyMethod : std::uint8_t {
    /// Edges are contracted to the position and attributes with the least quadric error (Garland and Heckbert 1997;
    /// Hoppe 1999). Small components may vanish. Without a limit of the error, the level of ProgressiveMesh with this
    /// number of triangles is the result where its certified distance is less, as for thin tubes.
    quadric,
    /// Vertices near the plane of their neighbours are removed, and their triangles replaced (Schroeder, Zarge and
    /// Lorensen 1992). The vertices that remain are the input's. The topology is kept: there may be no way to the
    /// number of triangles.
    decimation,
    /// Vertices in one cell of a grid become one (Rossignac and Borrel 1993), at the position with the least quadric
    /// error in the cell (Lindstrom 2000). The fastest method; parts may be joined or vanish.
    clustering,
};

/// Settings of simplify_mesh().
struct SimplifyMeshSettings {
    SimplifyMethod method = SimplifyMethod::quadric;  ///< how triangles are reduced
    std::size_t triangles = 0;                        ///< the mesh has at most this many, if it can
    /// Largest Hausdorff distance from the input, metres, >= 0; the mesh then may have more triangles than `triangles`.
    double error_m = std::numeric_limits<double>::infinity();
    double normal_weight = 0.01;             ///< as ProgressiveSettings::normal_weight
    double texture_coordinate_weight = 0.1;  ///< as ProgressiveSettings::texture_coordinate_weight
    double colour_weight = 0.02;             ///< as ProgressiveSettings::colour_weight
    /// [positions] nonzero: the vertex is kept, as are all others at its position. Empty: no vertex is locked.
    /// Clustering neither moves nor joins locked vertices, but their triangles may vanish.
    std::vector<std::uint8_t> locked = {};
};

/// A mesh with vertices of its own.
struct SimplifiedCopy {
    /// Its triangles use all of its vertices. Attributes are those that the input has.
    TriangleMesh mesh;
    /// Certified bound of the two-sided Hausdorff distance to the input, metres: no point of either surface is farther
    /// than this from the other surface. Usually at most a hundredth above the distance. 0 if the triangles are the
    /// input's.
    double error_m = 0.0;
    SimplifyStop stop = SimplifyStop::triangle_count;  ///< why it does not have fewer triangles
};

/// Simplifies a mesh with new vertices where they fit best, for levels that are stored one by one. ProgressiveMesh has
/// all levels of one list of vertices, with up to twice the distance at the same number of triangles.
///
/// Triangles whose corners are not at three different positions are dropped; error_m does not refer to them. Of several
/// vertices at one position each is kept apart (seams). One triangle is kept.
///
/// Fails:     invalid_argument if validate() refuses the mesh, or for a setting out of range
/// Threads:   any number of calls at once
/// Allocates: about 500 bytes per triangle, freed before it returns, and the result
/// Cost:      O(n log n); with a limit of the error, up to twelve times as much
/// Accuracy:  equal calls give the same bits (`SimplifyMesh.GivesTheSameBitsAgain`);
///            `SimplifyMesh.ErrorIsNotBelowTheMeasuredDistance` measures the bound
Result<SimplifiedCopy> simplify_mesh(const TriangleMesh& mesh,
                                     const SimplifyMeshSettings& settings);

}  // namespace terrane
