// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::test {

using MeshTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Distance of a point from a closed triangle, which may be a segment or a point.
double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// A lower bound of the two-sided Hausdorff distance of two surfaces with common vertices: the largest distance of
/// samples of either from all triangles of the other, one after the other.
///
/// @param per_edge samples along an edge: (per_edge + 1)(per_edge + 2) / 2 for each triangle
double measured_distance(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& a,
                         const MeshTriangles& b, int per_edge);

}  // namespace terrane::test
