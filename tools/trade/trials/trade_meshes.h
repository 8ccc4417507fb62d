// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <vector>

namespace terrane::tools {

/// Random points on the unit sphere: the same in every run.
std::vector<Eigen::Vector3d> sphere_points(std::size_t count);

/// A closed boulder of about 1 m: a subdivided octahedron whose corners are moved along their directions.
///
/// @param subdivisions 0 to 7: the mesh has 8 * 4^subdivisions triangles
/// @param roughness    largest displacement over the radius, 0 to 0.9
TriangleMesh make_boulder(int subdivisions, double roughness);

/// A rod of 20 x 2 x 2 m about its x axis, closed at its ends by points.
TriangleMesh make_rod_mesh(int triangles);

}  // namespace terrane::tools
