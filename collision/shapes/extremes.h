// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/polyhedron.h"

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// What find_extreme() climbs over: the vertices of a hull and their neighbours in a triangulation of
/// its surface, and where to begin.
struct ClimbTable {
    std::vector<std::uint32_t> first_neighbour;  ///< vertices + 1
    std::vector<std::uint32_t> neighbours;
    std::vector<std::uint32_t> starts;  ///< vertices near the extremes of a cube of directions
    int resolution = 0;                 ///< starts has 6 resolution^2 of them
    /// Two dot products that differ by more than this times |x| + |y| + |z| of the direction, metres,
    /// are in the true order, and so is the climb.
    double slack = 0.0;
};

/// From here on a climb is faster than a scan: tests/benchmark/extremes_benchmark has them cross at
/// 46 vertices, both at 39 ns.
inline constexpr std::size_t kClimbFrom = 48;

/// The vertex that is farthest along a direction: the largest dot(direction, vertex) as
/// vector_math.h computes it, and of equal ones the lowest index. Both ways give the same vertex,
/// for every direction, NaN and 0 included (then vertex 0).
///
/// @param direction body frame, any length
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      see find_extreme_by_scan() and find_extreme_by_climb(), of which it takes the faster
std::uint32_t find_extreme(const Polyhedron& hull, const Eigen::Vector3d& direction);

/// Looks at every vertex: about 1 ns each.
std::uint32_t find_extreme_by_scan(std::span<const Eigen::Vector3d> vertices,
                                   const Eigen::Vector3d& direction);

/// Looks up a vertex near the extreme, climbs over neighbours, and looks at those that are as far
/// within the rounding of dot products; where these are many, scans. About 40 ns for round hulls,
/// whatever their number of vertices; in a direction square to a large face as long as a scan.
std::uint32_t find_extreme_by_climb(std::span<const Eigen::Vector3d> vertices,
                                    const ClimbTable& table, const Eigen::Vector3d& direction);

/// Fills in the table's starts.
///
/// @param table_out its neighbours and slack are given
void fill_climb_starts(std::span<const Eigen::Vector3d> vertices, ClimbTable& table_out);

}  // namespace terrane::internal
