// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace terrane::test {

using MeshTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Distance of a point from a closed triangle, which may be degenerate.
double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// A lower bound of the two-sided Hausdorff distance between two surfaces over the same vertices: the largest distance
/// of a sample of one surface from all triangles of the other, in both directions.
///
/// @param per_edge samples along an edge: (per_edge + 1)(per_edge + 2) / 2 for each triangle
double measured_distance(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& a,
                         const MeshTriangles& b, int per_edge);

/// Vertices and triangles of a shape, counter-clockwise seen from outside or above.
struct ShapeMesh {
    std::vector<Eigen::Vector3d> vertices = {};  ///< metres
    MeshTriangles triangles = {};
};

/// An icosphere about the origin: each face of an icosahedron is divided into four `depth` times, 20 * 4^depth
/// triangles.
ShapeMesh make_sphere(double radius, int depth);

/// A grid of (columns + 1) x (rows + 1) vertices at place(column, row), with two triangles per cell, all cut along the
/// same diagonal.
ShapeMesh make_grid(int columns, int rows,
                    const std::function<Eigen::Vector3d(int column, int row)>& place);

/// A torus about the z axis, closed.
ShapeMesh make_torus(double radius, double tube_radius, int around, int across);

/// Mean edge length over all triangles.
double mean_edge(const ShapeMesh& mesh);

/// Numbers of edges (pairs of vertices) with one triangle, with two of opposite direction, and all others.
struct EdgeCounts {
    std::size_t border = 0;
    std::size_t inner = 0;
    std::size_t other = 0;
    std::size_t vertices = 0;  ///< used by triangles
};
EdgeCounts count_edges(const MeshTriangles& triangles);

/// A conifer 8 m high with its foot at the origin: a trunk and three cones, with colours and without normals.
///
/// @param sides around the trunk and each cone, >= 3
TriangleMesh make_tree(int sides);

/// A boulder of about 1.5 m, partly below the origin: a dented sphere, closed.
///
/// @param depth subdivisions of an icosahedron: 20 * 4^depth triangles
TriangleMesh make_rock(int depth, std::uint64_t seed);

/// The sides of a box, counter-clockwise seen from outside. Corner i is at the upper end of the x, y and z axis if bit
/// 0, 1 and 2 of i is set.
inline constexpr std::array<TriangleMesh::Triangle, 12> kBoxTriangles = {{{0, 2, 1},
                                                                          {1, 2, 3},
                                                                          {4, 5, 6},
                                                                          {5, 7, 6},
                                                                          {0, 1, 4},
                                                                          {1, 5, 4},
                                                                          {2, 6, 3},
                                                                          {3, 6, 7},
                                                                          {0, 4, 2},
                                                                          {2, 4, 6},
                                                                          {1, 3, 5},
                                                                          {3, 7, 5}}};

}  // namespace terrane::test
