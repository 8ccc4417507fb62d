// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Triangles of a mesh file.
struct SceneMesh {
    std::vector<Eigen::Vector3d> points;  ///< as in the file, in its order
    /// Indices of points. Points with the same three coordinates count as the first of them, because many programs
    /// write a corner once for each of its normals.
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Most points, and most triangles, of a mesh file.
inline constexpr std::size_t kMostMeshParts = std::size_t{1} << 22;

/// Reads a file whose name ends in .ply or .obj, in any case. Polygons become fans of triangles; what is no point and
/// no face is ignored.
///
/// Fails: io where the file cannot be read; bad_data where it is no such file, ends early, has more than
///        kMostMeshParts points or triangles, names points that it does not have, or has no triangle. The message
///        names the file.
Result<SceneMesh> read_mesh(const std::string& path);

/// The text of a PLY file: ascii, binary_little_endian or binary_big_endian. Fails as read_mesh(), without the name.
Result<SceneMesh> parse_ply(std::string_view bytes);

/// The text of a Wavefront OBJ file; only its lines v and f. Fails as read_mesh(), without the name.
Result<SceneMesh> parse_obj(std::string_view text);

/// Adds a polygon as a fan, without triangles that have a point twice.
///
/// Fails: bad_data for fewer than three corners, a corner that is no point of the mesh, or too many triangles
///
/// @param corners indices of points, counted from 0
Result<void> add_polygon(const std::vector<std::int64_t>& corners, SceneMesh& mesh);

}  // namespace terrane::tools
