// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::test {

/// All triangles of a frame, chunks' and volumes', with each displayed position once, bit for bit.
struct FrameMesh {
    std::vector<WorldPos> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;

    explicit FrameMesh(const TerrainMesh& mesh);

    /// Empty, or what is wrong: an inner edge that does not have exactly one triangle in each direction, a border edge
    /// that is not on the world's border, a triangle with two equal vertices, a count that is not the mesh's.
    std::string find_flaw(const TerrainMesh& mesh) const;

    /// Distance of a point to the nearest triangle, by brute force.
    double distance(const Eigen::Vector3d& p_world) const;
};

/// Distance between a point and a triangle.
double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace terrane::test
