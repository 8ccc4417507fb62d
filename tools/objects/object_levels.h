// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/object_settings.h>
#include <terrane/scene/object_model.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace terrane::tools {

/// A mesh with levels of detail for a Scene.
struct ObjectLevels {
    ObjectModel model;  ///< its mesh and impostor are 0 until they are made
    TriangleMesh mesh;  ///< the vertices of all levels
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
    /// [levels that are meshes] MeshLevel::morph_targets
    std::vector<std::vector<std::uint32_t>> morph_targets;

    /// For TerrainRenderer::add_mesh(); views of this.
    std::vector<MeshLevel> mesh_levels() const;
};

/// Contracts a mesh (ProgressiveMesh) to levels of a thousandth to a hundredth of its size that morph into each
/// other, with an impostor after them and its whole size as the error of its absence. Levels that save little are
/// left out. A mesh of many triangles has continuous levels too (ObjectModel::continuous).
///
/// Fails: invalid_argument as ProgressiveMesh::create(), and for a mesh without extent
Result<ObjectLevels> make_levels(const TriangleMesh& mesh);

}  // namespace terrane::tools
