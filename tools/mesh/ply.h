// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::tools {

/// Triangles that share their vertices, in world coordinates.
struct IndexedMesh {
    std::vector<WorldPos> vertices_world;
    /// Counter-clockwise seen from above.
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// One mesh out of what the chunks of a frame draw, at the heights that are displayed. Samples of
/// different chunks are one vertex where they are one lattice point and displayed at the same height,
/// bit for bit. The promise is that they always are; where they were not, the crack would show as an
/// edge with one triangle.
IndexedMesh weld(const TerrainMesh& mesh);

/// Binary little-endian PLY: double x, y, z; list uchar uint vertex_indices.
/// Fails with io, naming the path; nothing is left there then but what was before.
Result<void> write_ply(const IndexedMesh& mesh, const std::string& path);

}  // namespace terrane::tools
