// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A triangle, for split_to_clusters().
struct SplitPoint {
    Eigen::Vector3d place;   ///< its centroid
    Eigen::Vector3d normal;  ///< unit; zero: of no use
    std::uint32_t index = 0;
};

/// Reorders triangles to consecutive clusters of at most `most`, each near in place and normal; triangles without a
/// normal are in the last ones, apart. A function of the points, and of their indices where they are equal. Within a
/// cluster indices ascend.
///
/// @returns numbers of triangles
std::vector<std::uint32_t> split_to_clusters(std::span<SplitPoint> points, std::uint32_t most);

}  // namespace terrane::internal
