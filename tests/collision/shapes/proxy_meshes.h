// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/collision_proxy.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

// Closed meshes of known shape; metres.
namespace terrane::test {

/// A named mesh.
struct NamedMesh {
    std::string name;
    TriangleMesh mesh;
};

TriangleMesh box_mesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

/// A prism over a counter-clockwise polygon in the xy plane; `faces` triangulates it by corner indices.
TriangleMesh prism_mesh(std::span<const Eigen::Vector2d> corners,
                        std::span<const TriangleMesh::Triangle> faces, double height);

/// Volume 3: squares of side 2 minus one of side 1, height 1.
TriangleMesh l_mesh();

/// A star of five points, radii 0.4 and 1, height 0.3.
TriangleMesh star_mesh();

/// A closed tube around a curve of [0, 1): a torus, or the trefoil knot.
TriangleMesh torus_mesh(std::size_t around, std::size_t across, double large, double small);
TriangleMesh knot_mesh(std::size_t around, std::size_t across, double small);

/// A half ball of radius 1 with a half ball of radius 0.8 removed.
TriangleMesh bowl_mesh(std::size_t around);

/// Two balls of radius 0.5 joined by a rod of radius 0.15; 2.4 m long.
TriangleMesh dumb_bell_mesh(std::size_t around);

/// A ball of radius 1 with vertices moved inwards by up to `depth`, by a hash of the seed.
TriangleMesh rock_mesh(std::size_t around, double depth, std::uint64_t seed);

/// Seat, back and four legs as six overlapping boxes.
TriangleMesh chair_mesh();

/// All these meshes.
std::vector<NamedMesh> proxy_meshes();

/// Largest sampled distances, metres.
struct ProxyDistance {
    double mesh_to_proxy = 0.0;
    double proxy_to_mesh = 0.0;
};

/// Distance from a point to a triangle by a search over barycentric coordinates: slow and independent of the library.
double slow_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& p);

/// Winding number about a point as the sum of solid angles (van Oosterom and Strackee 1983).
double solid_angle_winding(const TriangleMesh& mesh, const Eigen::Vector3d& p);

/// Measures both distances at random points, uniform by area over the triangles of the mesh and the faces of the parts.
ProxyDistance measure_proxy(const TriangleMesh& mesh, const CollisionProxy& proxy,
                            std::size_t samples, std::uint64_t seed);

}  // namespace terrane::test
