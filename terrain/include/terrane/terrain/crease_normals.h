// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace terrane {

/// [vertices] the first vertex with the same position; in a mesh with NaN each vertex itself.
std::vector<std::uint32_t> first_at_position(const TriangleMesh& mesh);

/// The mesh with one vertex for each smooth group of corners at a vertex, and with normals: the mean of the group's
/// triangles, weighted by their angles there. Two corners are in one group if their triangles share an edge at the
/// vertex, and the angle between their normals is at most a crease angle.
///
/// @param mesh         without normals; vertices of equal positions are one here, and keep their other attributes
/// @param least_cosine of the crease angle
TriangleMesh with_crease_normals(const TriangleMesh& mesh, double least_cosine);

}  // namespace terrane
