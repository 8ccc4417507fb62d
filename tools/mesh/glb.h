// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/ply.h"

#include <string>

namespace terrane::tools {

/// Binary glTF 2.0 of one mesh. glTF's y is up and its z points south. Positions are float, relative to the translation of
/// the mesh's node, the middle of its box: off by at most 2^-24 of the box's half size, some millimetres for 100 km.
///
/// Fails: io, naming the path; invalid_argument where the file would have 4 GiB or more. Nothing is left there then
///        but what was before
Result<void> write_glb(const IndexedMesh& mesh, const std::string& path);

}  // namespace terrane::tools
