// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/convex_hull.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::tools {

/// The vertex of a convex hull that is farthest along a direction, by two methods. Both are written here, apart from
/// the library's, whose support_distance() chooses one by the number of vertices.
///
/// Source: G. van den Bergen. Collision Detection in Interactive 3D Environments, 2003, 4.3.4 (hill climbing from
/// vertex to vertex along edges). Here it begins at the best of six vertices, the extremes along the axes.
class ExtremeSearch {
public:
    explicit ExtremeSearch(const ConvexHull& hull);

    /// Compares all vertices. Cost: O(vertices)
    std::uint32_t by_scan(const Eigen::Vector3d& direction) const;
    /// Climbs along edges until no neighbour is farther. Cost: O(sqrt(vertices)) for even hulls
    std::uint32_t by_climb(const Eigen::Vector3d& direction) const;

private:
    std::vector<Eigen::Vector3d> vertices_;
    std::vector<std::uint32_t> first_neighbour_;  // [vertices + 1] into neighbours_
    std::vector<std::uint32_t> neighbours_;
    std::vector<std::uint32_t> starts_;
};

}  // namespace terrane::tools
