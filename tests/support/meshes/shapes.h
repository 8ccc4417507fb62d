// SPDX-License-Identifier: MIT
#pragma once

#include "support/meshes/mesh_distance.h"

#include <cstddef>
#include <functional>

namespace terrane::test {

/// Vertices and triangles of a shape, wound counter-clockwise seen from outside or above.
struct ShapeMesh {
    std::vector<Eigen::Vector3d> vertices = {};  ///< metres
    MeshTriangles triangles = {};
};

/// An icosahedron whose faces are cut in four `depth` times, on a sphere about the origin: 20 * 4^depth triangles.
ShapeMesh make_sphere(double radius, int depth);

/// (columns + 1) x (rows + 1) vertices in a grid, each at place(column, row). Two triangles a cell, all cut alike.
ShapeMesh make_grid(int columns, int rows,
                    const std::function<Eigen::Vector3d(int column, int row)>& place);

/// A torus about the z axis, closed.
ShapeMesh make_torus(double radius, double tube_radius, int around, int across);

/// Length of edges, averaged over triangles.
double mean_edge(const ShapeMesh& mesh);

/// How many edges (pairs of vertices) have one triangle, two that run through it in opposite directions, and else.
struct EdgeCounts {
    std::size_t border = 0;
    std::size_t inner = 0;
    std::size_t other = 0;
    std::size_t vertices = 0;  ///< that triangles use
};
EdgeCounts count_edges(const MeshTriangles& triangles);

}  // namespace terrane::test
