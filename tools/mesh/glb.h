// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/ply.h"

#include <string>

namespace terrane::tools {

/// Writes one mesh as binary glTF 2.0, with its normals; y is up and z points south. Positions are float, relative to
/// the centre of the bounding box, which is the translation of the node: rounding error at most 2^-24 of the box's half
/// size, some millimetres for 100 km.
///
/// Fails: io, naming the path; invalid_argument where the file would have 4 GiB or more. A file that was there is
///        unchanged then
Result<void> write_glb(const IndexedMesh& mesh, const std::string& path);

}  // namespace terrane::tools
