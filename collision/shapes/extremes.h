// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/polyhedron.h"

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Data of the hill climb of find_extreme(): the vertices' neighbours in a triangulation of the surface, and start
/// vertices.
struct ClimbTable {
    std::vector<std::uint32_t> first_neighbour;  ///< vertices + 1
    std::vector<std::uint32_t> neighbours;
    std::vector<std::uint32_t> starts;  ///< vertices near the extremes of a cube of directions
    int resolution = 0;                 ///< starts has 6 resolution^2 of them
    /// Rounding bound, metres: dot products that differ by more than this times the direction's 1-norm are in the exact
    /// order.
    double slack = 0.0;
};

/// Number of vertices from which a climb is faster than a scan: in extremes_benchmark they cross at 46 vertices, both
/// at 39 ns.
inline constexpr std::size_t kClimbFrom = 48;

/// Support vertex: the vertex with the largest dot(direction, vertex) as vector_math.h computes it, of ties the lowest
/// index; vertex 0 for a direction of 0 or NaN. Scan and climb give the same vertex for every direction.
///
/// @param direction body frame, any length
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      that of the faster of find_extreme_by_scan() and find_extreme_by_climb()
std::uint32_t find_extreme(const Polyhedron& hull, const Eigen::Vector3d& direction);

/// Evaluates every vertex: about 1 ns each.
std::uint32_t find_extreme_by_scan(std::span<const Eigen::Vector3d> vertices,
                                   const Eigen::Vector3d& direction);

/// Starts at a vertex from the table, climbs over neighbours, then searches all vertices within the rounding of the
/// maximum; scans where these are many. About 40 ns for round hulls of any size; as slow as a scan in a direction
/// orthogonal to a large face.
std::uint32_t find_extreme_by_climb(std::span<const Eigen::Vector3d> vertices,
                                    const ClimbTable& table, const Eigen::Vector3d& direction);

/// Fills in the start vertices.
///
/// @param table_out neighbours and slack are set
void fill_climb_starts(std::span<const Eigen::Vector3d> vertices, ClimbTable& table_out);

}  // namespace terrane::internal
