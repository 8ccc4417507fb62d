// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <span>

namespace terrane {

/// Metres on a mesh that a difference of 1 in texture coordinates spans on average: the square root of the ratio of the
/// areas of all triangles. 0 for a mesh without texture coordinates, or whose triangles have no area there.
///
/// Cost: O(n)
double metres_per_texture_coordinate(const TriangleMesh& mesh);

/// How far a level of detail displaces the texture of its mesh, metres: the largest distance from a vertex of the mesh
/// to the level, in space and texture together. A difference of texture coordinates counts as the metres that it spans
/// on average. Points of the level with another material are infinitely far. An estimate, because only vertices are
/// measured: ProgressiveMesh::error_m(), which is a bound, does not include texture.
///
/// @param mesh         with texture coordinates; as validate() accepts it
/// @param level        indices of the mesh's vertices
/// @param most_samples largest number of vertices that are measured; these are spread evenly over their order
/// @return             0 if no triangle of the mesh has vertices; infinity if the level is empty
///
/// Allocates: about 200 bytes per triangle of the level, freed before it returns
/// Cost:      O(m log m) for the level, and O(log m) per sample for most meshes
/// Source:    J. Cohen, M. Olano, D. Manocha. Appearance-Preserving Simplification. SIGGRAPH 1998 (texture deviation).
///            Deviation: the nearest point in space and texture, instead of the point with the same texture coordinates
double texture_shift_m(const TriangleMesh& mesh, std::span<const TriangleMesh::Triangle> level,
                       std::size_t most_samples = 4096);

}  // namespace terrane
