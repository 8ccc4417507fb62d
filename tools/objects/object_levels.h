// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/object_model.h>
#include <terrane/terrain/triangle_mesh.h>

#include <vector>

namespace terrane::tools {

/// A mesh with levels of detail for a Scene.
struct ObjectLevels {
    ObjectModel model;  ///< its mesh and impostor are 0 until they are made
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
};

/// Simplifies a mesh to levels of a thousandth to a hundredth of its size, with an impostor after them and its whole
/// size as the error of its absence. Levels that save little are left out.
///
/// Fails: invalid_argument as simplify() and check(TriangleMesh), and for a mesh without extent
Result<ObjectLevels> make_levels(const TriangleMesh& mesh);

}  // namespace terrane::tools
