// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

namespace terrane {

/// Certified upper bound of the two-sided Hausdorff distance between the surfaces of two meshes, metres: no point of
/// either is farther from the other. Exceeds the distance by at most a hundredth and 1e-10 of the size of both
/// surfaces, unless the limit of 100 steps for a triangle is reached. Infinity if one of them has no triangles; 0 if
/// neither has. Both meshes must be valid (TriangleMesh::validate()).
///
/// Cost: O(n log n), about a query of the nearest triangle for each cell of the overlay of the two surfaces
double bound_surface_distance(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace terrane
