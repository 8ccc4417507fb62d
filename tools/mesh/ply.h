// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::tools {

/// Triangles that share their vertices, in world coordinates or those of an object.
struct IndexedMesh {
    std::vector<WorldPos> vertices_world;
    /// Counter-clockwise seen from outside the ground: from above, but for ceilings of volumes.
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// [vertices_world] red, green, blue, opacity with display gamma, or empty.
    std::vector<std::array<std::uint8_t, 4>> colours = {};
    std::vector<Eigen::Vector3f> normals = {};  ///< [vertices_world] unit length, or empty
    std::vector<Eigen::Vector2f> texture_coordinates = {};  ///< [vertices_world], or empty
};

/// Whether a mesh has normals.
enum class Normals { without, with };

/// The triangles of all chunks and volumes of a frame as one mesh: expand_mesh().
IndexedMesh weld(const TerrainMesh& mesh, Normals normals = Normals::without);

/// Binary little-endian PLY: double x, y, z; where the mesh has them float nx, ny, nz, float s, t, and uchar red,
/// green, blue; list uchar uint vertex_indices.
/// Fails with io, naming the path; a file that was there is unchanged then.
Result<void> write_ply(const IndexedMesh& mesh, const std::string& path);

}  // namespace terrane::tools
