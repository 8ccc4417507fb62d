// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Most points, and most triangles, of a mesh file.
inline constexpr std::size_t kMostMeshParts = std::size_t{1} << 22;

/// Reads a file whose name ends in .ply, .obj, .glb, .gltf or .stl, in any case: positions as in the file and in its
/// order, and the colours of vertices where all have one. The meshes of all nodes of .glb and .gltf are one, with z up;
/// a vertex without a colour has its material's. Textures and files beside are not read. Polygons become fans of
/// triangles; anything else is ignored. Triangles name the first of vertices with the same three coordinates, because
/// many programs write a corner once for each of its normals: normals and texture coordinates are not kept.
///
/// Fails: io where the file cannot be read; bad_data where it is no such file, ends early, has more than
///        kMostMeshParts points or triangles, names points that it does not have, or has no triangle. The message
///        names the file.
Result<TriangleMesh> read_mesh(const std::string& path);

/// The same with normals and texture coordinates where all vertices have them, in PLY (nx, ny, nz; s, t or u, v) and
/// OBJ (vt, vn): a vertex for each combination of position and attributes that a corner has. Points that no corner has
/// are left out in OBJ. Of other formats as read_mesh().
Result<TriangleMesh> read_mesh_with_attributes(const std::string& path);

/// The text of a PLY file: ascii, binary_little_endian or binary_big_endian, with colours as red, green and blue of
/// type uchar or, from 0 to 1, float. Fails as read_mesh(), without the name.
Result<TriangleMesh> parse_ply(std::string_view bytes);

/// The text of a Wavefront OBJ file; only its lines v, with a colour from 0 to 1 after the position where there is one,
/// and f. Fails as read_mesh(), without the name.
Result<TriangleMesh> parse_obj(std::string_view text);
/// The same with lines vt and vn: see read_mesh_with_attributes().
Result<TriangleMesh> parse_obj_with_attributes(std::string_view text);

/// The bytes of a file of another kind, by its ending without the full stop, in small letters. Fails as read_mesh(),
/// without the name.
Result<TriangleMesh> parse_with_assimp(std::string_view bytes, const std::string& ending);

/// Adds a polygon as a fan, without triangles that have a point twice.
///
/// Fails: bad_data for fewer than three corners, a corner that is no point of the mesh, or too many triangles
///
/// @param corners indices of points, counted from 0
Result<void> add_polygon(const std::vector<std::int64_t>& corners, TriangleMesh& mesh);

}  // namespace terrane::tools
