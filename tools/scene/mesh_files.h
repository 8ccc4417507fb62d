// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Largest number of points, and of triangles, in a mesh file.
inline constexpr std::size_t kMostMeshParts = std::size_t{1} << 22;

/// Reads a file whose name ends in .ply, .obj, .glb, .gltf or .stl, in any case: positions in the file's order, and
/// vertex colours if all vertices have one. The meshes of all nodes of .glb and .gltf are joined, with z up; a vertex
/// without a colour gets its material's. Textures and external files are not read. Polygons become fans of triangles;
/// points, lines and other elements are ignored. Of several vertices with equal coordinates triangles use the first,
/// because many programs write a vertex once for each of its normals. Normals and texture coordinates are dropped.
///
/// Fails: io if the file cannot be read or has more than 2^30 bytes; bad_data if its format is invalid, or if it is
///        truncated, has more than kMostMeshParts points or triangles, refers to missing points, or has no triangle.
///        The message names the file.
Result<TriangleMesh> read_mesh(const std::string& path);

/// Reads a PLY or OBJ file with normals (nx, ny, nz or vn) and texture coordinates (s, t, or u, v, or vt) if all
/// vertices have them. Vertices are not joined: OBJ gives one for each combination of position and attributes of a
/// corner, and its points without a face are dropped. Other formats are read as by read_mesh().
Result<TriangleMesh> read_mesh_with_attributes(const std::string& path);

/// Parses the bytes of a PLY file: ascii, binary_little_endian or binary_big_endian; colours are red, green and blue of
/// type uchar, or float from 0 to 1. Fails as read_mesh(), but messages do not name the file.
Result<TriangleMesh> parse_ply(std::string_view bytes);

/// Parses the text of a Wavefront OBJ file. Reads only lines f, and lines v with an optional colour from 0 to 1 after
/// the position. Fails as read_mesh(), but messages do not name the file.
Result<TriangleMesh> parse_obj(std::string_view text);
/// Parses an OBJ file with its lines vt and vn: see read_mesh_with_attributes().
Result<TriangleMesh> parse_obj_with_attributes(std::string_view text);

/// Parses the bytes of a file of another format. `ending` is the file's extension without the full stop, in lower case.
/// Fails as read_mesh(), but messages do not name the file.
Result<TriangleMesh> parse_with_assimp(std::string_view bytes, const std::string& ending);

/// Adds a polygon as a fan of triangles, including triangles with a repeated point.
///
/// Fails: bad_data for fewer than three corners, an index beyond the mesh's points, or too many triangles
///
/// @param corners indices of points, counted from 0
Result<void> add_polygon(const std::vector<std::int64_t>& corners, TriangleMesh& mesh);

/// Triangles with shared vertices, in the coordinates of the world or of an object.
struct IndexedMesh {
    std::vector<WorldPos> vertices_world;
    /// Counter-clockwise seen from outside the solid.
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// [vertices_world] red, green, blue (with display gamma) and opacity, or empty.
    std::vector<std::array<std::uint8_t, 4>> colours = {};
    std::vector<Eigen::Vector3f> normals = {};  ///< [vertices_world] unit length, or empty
    std::vector<Eigen::Vector2f> texture_coordinates = {};  ///< [vertices_world], or empty
};

/// Whether a mesh has normals.
enum class Normals { without, with };

/// The triangles of all chunks and volumes of a frame as one mesh, made by expand_mesh().
IndexedMesh weld(const TerrainMesh& mesh, Normals normals = Normals::without);

/// Writes a binary little-endian PLY: double x, y, z; float nx, ny, nz, float s, t, uchar red, green, blue if the mesh
/// has them; list uchar uint vertex_indices. Fails with io, naming the path; an existing file is then unchanged.
Result<void> write_ply(const IndexedMesh& mesh, const std::string& path);

/// Writes one mesh as binary glTF 2.0, with its normals; y is up and z points south. Positions are float, relative to
/// the centre of the bounding box, which is the translation of the node. They are rounded by at most 2^-24 of the box's
/// half side, which is 3 mm for a side of 100 km.
///
/// Fails: io, naming the path; invalid_argument if the file would have 4 GiB or more. An existing file is then
///        unchanged
Result<void> write_glb(const IndexedMesh& mesh, const std::string& path);

/// File formats of meshes.
enum class MeshFormat {
    ply,  ///< binary little-endian PLY: double x, y, z; attributes; list uchar uint vertex_indices
    obj,  ///< Wavefront OBJ: text, coordinates with all digits, colours after them, vt, vn; z is up, as in the world
    glb,  ///< binary glTF 2.0: y is up, z south; float positions relative to the node's translation, normals
};

/// The extensions of the formats, for messages.
inline constexpr const char* kMeshEndings = ".ply, .obj or .glb";

/// The format by the extension of a path, in any case; absent for an unknown extension. PLY if the path exists and is
/// not a regular file (a pipe, /dev/stdout).
std::optional<MeshFormat> mesh_format(const std::string& path);

/// Writes a mesh; replaces an existing file.
///
/// Fails: io, naming the path; invalid_argument if a GLB would have 4 GiB or more. An existing file is then
///        unchanged
Result<void> write_mesh(const IndexedMesh& mesh, MeshFormat format, const std::string& path);

}  // namespace terrane::tools
