// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/triangle_mesh.h>

namespace terrane {

// Meshes of simple solids around the origin, closed, with outward normals. Round ones have 32 segments around z and
// their vertices on the surface. For pictures: their bits depend on the C library.

/// A box from -half_extents to half_extents, metres.
///
/// Fails: invalid_argument, naming the size, for one that is not above 0 and at most 1e5 m
Result<TriangleMesh> make_box_mesh(const Eigen::Vector3d& half_extents);
/// A sphere. Fails as make_box_mesh()
Result<TriangleMesh> make_sphere_mesh(double radius);
/// About z: a cylinder from -half_height to half_height with a half sphere on each end. Fails as make_box_mesh(), but a
/// half_height of 0 is a sphere.
Result<TriangleMesh> make_capsule_mesh(double radius, double half_height);
/// A cylinder about z, from -half_height to half_height, with flat ends. Fails as make_box_mesh()
Result<TriangleMesh> make_cylinder_mesh(double radius, double half_height);

}  // namespace terrane
