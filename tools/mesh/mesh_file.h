// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/ply.h"

#include <optional>
#include <string>

namespace terrane::tools {

/// File formats of meshes.
enum class MeshFormat {
    ply,  ///< binary little-endian PLY: double x, y, z; attributes; list uchar uint vertex_indices
    obj,  ///< Wavefront OBJ: text, coordinates with all digits, colours after them, vt, vn; z is up, as in the world
    glb,  ///< binary glTF 2.0: y is up, z south; float positions relative to the node's translation, normals
};

/// The extensions of the formats in one text.
inline constexpr const char* kMeshEndings = ".ply, .obj or .glb";

/// The format of a file extension, in any case; absent for another one. PLY where the path exists and is not a regular
/// file (a pipe, /dev/stdout).
std::optional<MeshFormat> mesh_format(const std::string& path);

/// Writes a mesh; replaces an existing file.
///
/// Fails: io, naming the path; invalid_argument where a GLB would have 4 GiB or more. A file that was there is
///        unchanged then
Result<void> write_mesh(const IndexedMesh& mesh, MeshFormat format, const std::string& path);

}  // namespace terrane::tools
