// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace terrane::test {

/// All triangles of a frame, chunks' and volumes', with each displayed position once, bit for bit.
struct FrameMesh {
    std::vector<WorldPos> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;

    FrameMesh() = default;
    explicit FrameMesh(const TerrainMesh& mesh);

    /// Empty, or what is wrong: an inner edge that does not have exactly one triangle in each direction, a border edge
    /// that is not on the world's border, a triangle with two equal vertices, a count that is not the mesh's.
    std::string find_flaw(const TerrainMesh& mesh) const;

    /// Adds the surface of a chunk at its finest: its solid's triangles, and its heightfield's that these do not
    /// replace.
    void add_finest(const Lattice& lattice, const Chunk& chunk);

    /// The triangle that is nearest to a point, by brute force, and its distance, metres.
    struct Nearest {
        double distance = std::numeric_limits<double>::infinity();
        std::size_t triangle = 0;
    };
    Nearest nearest(const Eigen::Vector3d& p_world) const;
};

}  // namespace terrane::test
