// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/render/material.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Largest number of points, and of triangles, in a mesh file.
inline constexpr std::size_t kMostMeshParts = std::size_t{1} << 22;

/// What a mesh lacks of its file.
struct MeshLosses {
    std::size_t flat_triangles = 0;  ///< dropped: two of their corners have the same position
    std::size_t crossing_faces = 0;  ///< polygons that cross themselves: their triangles overlap
    std::size_t lines = 0;           ///< points, lines and curves
    std::size_t skins = 0;           ///< nodes whose mesh is bent by joints: taken as it is stored
    std::size_t blended = 0;         ///< materials that blend: drawn with an alpha cut
    std::vector<std::string> textures =
        {};  ///< what of materials and textures is not drawn, and why
};

/// The mesh of a file.
struct FileMesh : TriangleMesh {
    MeshLosses left_out = {};
    /// Indexed by TriangleMesh::materials. Empty if materials were not asked for, or if the file has none.
    std::vector<MeshMaterial> surfaces = {};
};

/// Whether the materials of a file, its texture coordinates and images are read.
enum class FileMaterials { without, with };

/// Reads a file whose name ends in .ply, .obj, .glb, .gltf or .stl, in any case: positions in the file's order, and
/// vertex colours if all vertices have one. Of several vertices with equal coordinates triangles use the first, because
/// many programs write a vertex once for each of its normals. Normals and texture coordinates are dropped.
///
/// Polygons are triangulated in their plane, concave ones too (split_polygon()). Triangles of which two corners have
/// one position are dropped. Points, lines and other elements, skins and textures are not read. A note on standard
/// error counts all of these but textures, which read_model() reads.
///
/// Of .glb and .gltf, the meshes of the default scene's nodes are joined, with z up; without a default scene, those of
/// all scenes. Morph targets have their default weights, instances of EXT_mesh_gpu_instancing are placed. A vertex has
/// its own colour times the base colour of its material. External buffers are read from the file's folder and the
/// folders in it. Of required extensions, KHR_mesh_quantization and EXT_mesh_gpu_instancing are read, and those of
/// textures, materials and lights are ignored.
///
/// Fails: io if the file or a buffer cannot be read or has more than 2^30 bytes; bad_data if its format is invalid, or
///        if it is truncated, has more than kMostMeshParts points or triangles, refers to missing points, has no
///        triangle, or requires another extension. The message names the file.
Result<TriangleMesh> read_mesh(const std::string& path);

/// Reads a file with normals (nx, ny, nz; vn; NORMAL) and texture coordinates (s, t, or u, v; vt) if all vertices have
/// them; of glTF only normals. Vertices are not joined: OBJ gives one for each combination of position and attributes
/// of a corner, and its points without a face are dropped. STL has no attributes.
Result<TriangleMesh> read_mesh_with_attributes(const std::string& path);

/// A mesh with the materials of its file.
struct MeshModel {
    TriangleMesh mesh;
    /// Indexed by TriangleMesh::materials; empty if all materials are plain and one-sided: the colours of the vertices
    /// are then enough, and there are no texture coordinates.
    std::vector<MeshMaterial> materials;
};

/// Reads a file as read_mesh_with_attributes(), with its materials: of .glb and .gltf, sections 3.8 and 3.9 of glTF; of
/// .obj, `Kd`, `map_Kd`, `norm` and `map_d` of the files that `mtllib` names.
///
/// An image that is absent, truncated, too large or of another format is noted on standard error by its name, and the
/// material is drawn without it.
///
/// Fails: as read_mesh()
Result<MeshModel> read_model(const std::string& path);

/// Largest number of pixels of an image: a file of a few kilobytes may claim 10^9.
inline constexpr std::uint64_t kMostTexturePixels = std::uint64_t{1} << 26;

/// Decodes a PNG or JPEG image. Its size is checked before its pixels are read. Fails: bad_data; the message does not
/// name the file.
Result<std::shared_ptr<const TextureImage>> decode_image(std::string_view bytes);
/// Reads an image beside a mesh file. Fails: io, or bad_data, also for a name that is_path_below() refuses; the message
/// does not name the file.
Result<std::shared_ptr<const TextureImage>> read_image(const std::string& folder,
                                                       const std::string& name);

/// Reads a Wavefront material file: materials by name. What cannot be read is added to `left_out`.
std::map<std::string, MeshMaterial> read_mtl(const std::string& folder, const std::string& name,
                                             MeshLosses& left_out);

/// Whether a path names a file in a folder or below it: files of others must not name any file of the machine.
bool is_path_below(const std::filesystem::path& name);

/// The text without the spaces, tabs and line ends around it.
std::string_view trimmed(std::string_view text);
/// Removes the first word of a text and returns it; empty if there is none. Words are separated by spaces, tabs and
/// line ends.
std::string_view read_word(std::string_view& text);

/// Makes corners refer to the first of equal positions, and drops normals and texture coordinates: what read_mesh()
/// gives for the file that read_mesh_with_attributes() read.
void join_vertices(TriangleMesh& mesh);

/// Parses the bytes of a PLY file: ascii, binary_little_endian or binary_big_endian; colours are red, green and blue of
/// type uchar, or float from 0 to 1. Fails as read_mesh(), but messages do not name the file.
Result<FileMesh> parse_ply(std::string_view bytes);

/// Parses the text of a Wavefront OBJ file. Reads only lines f, and lines v with an optional colour from 0 to 1 after
/// the position. A line that ends in a backslash goes on in the next. Fails as read_mesh(), but messages do not name
/// the file.
Result<FileMesh> parse_obj(std::string_view text);
/// Parses an OBJ file with its lines vt and vn: see read_mesh_with_attributes().
Result<FileMesh> parse_obj_with_attributes(std::string_view text);
/// Parses an OBJ file with its attributes and materials. A corner without texture coordinates has (0, 0).
///
/// @param folder of the file, for its material files and images
Result<FileMesh> parse_obj_with_materials(std::string_view text, const std::string& folder);

/// Parses the bytes of an STL file, text or binary; its normals and colours are not read. Triangles use the first of
/// equal points. Fails as read_mesh(), but messages do not name the file.
Result<FileMesh> parse_stl(std::string_view bytes);

/// Parses the bytes of a .gltf or .glb file, with normals. Fails as read_mesh(), but messages do not name the file.
///
/// @param folder    of the file, for its external buffers and images
/// @param materials with: also texture coordinates and images
Result<FileMesh> parse_gltf(std::string_view bytes, const std::string& folder,
                            FileMaterials materials = FileMaterials::without);

/// Reads a file. Fails: io if it cannot be read or has more than 2^30 bytes; the message does not name the file.
Result<std::string> read_whole_file(const std::string& path);

/// Splits a polygon into triangles, counter-clockwise as the polygon: a fan around the first corner if that covers it
/// once; otherwise by ear clipping, seen along the axis that is closest to the polygon's normal. A polygon may be out
/// of a plane, touch itself, and repeat corners, which gives triangles with a repeated point. One that crosses itself
/// is counted in `mesh.left_out`.
///
/// Fails: bad_data for fewer than three corners, an index beyond the mesh's points, too many triangles, or more than
///        8192 corners if a fan does not do
///
/// @param corners       indices of the mesh's points, counted from 0
/// @param triangles_out indices of corners
Result<void> split_polygon(std::span<const std::int64_t> corners, FileMesh& mesh,
                           std::vector<TriangleMesh::Triangle>& triangles_out);

/// Triangles with shared vertices, in the coordinates of the world or of an object.
struct IndexedMesh {
    std::vector<WorldPos> vertices_world;
    /// Counter-clockwise seen from outside the solid.
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// [vertices_world] red, green, blue (with display gamma) and opacity, or empty.
    std::vector<std::array<std::uint8_t, 4>> colours = {};
    std::vector<Eigen::Vector3f> normals = {};  ///< [vertices_world] unit length, or empty
    std::vector<Eigen::Vector2f> texture_coordinates = {};  ///< [vertices_world], or empty
    /// Whether x and y are longitude and latitude, degrees in WGS 84: a comment of PLY and OBJ files says so.
    bool is_lonlat = false;
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
