// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/ply.h"

#include <optional>
#include <string>

namespace terrane::tools {

/// What a mesh can be written as.
enum class MeshFormat {
    ply,  ///< binary little-endian PLY: double x, y, z; list uchar uint vertex_indices
    obj,  ///< Wavefront OBJ: text, every digit of the coordinates; z is up, as in the world
    glb,  ///< binary glTF 2.0: y is up, z south; float positions about a node's translation
};

/// The endings of the formats, as a person would list them.
inline constexpr const char* kMeshEndings = ".ply, .obj or .glb";

/// By the ending of the name, in small or capital letters; nothing for another one. What is there and is no regular
/// file (a pipe, /dev/stdout) gets PLY.
std::optional<MeshFormat> mesh_format(const std::string& path);

/// Writes a mesh. A file that is there is replaced.
/// Fails: io, naming the path; invalid_argument where a GLB would have 4 GiB or more. Nothing is left there then but
///        what was before
Result<void> write_mesh(const IndexedMesh& mesh, MeshFormat format, const std::string& path);

}  // namespace terrane::tools
