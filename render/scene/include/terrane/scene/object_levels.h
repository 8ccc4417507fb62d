// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

/// A mesh with levels of detail for a Scene.
struct ObjectLevels {
    ObjectModel model;  ///< its mesh and impostor ids are 0 until a renderer creates them
    TriangleMesh mesh;  ///< the vertices of all levels
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
    /// [levels that are meshes] MeshLevel::morph_targets
    std::vector<std::vector<std::uint32_t>> morph_targets;

    /// The levels as an argument of TerrainRenderer::add_mesh(); they refer to this object's arrays.
    std::vector<MeshLevel> mesh_levels() const;
};

/// Makes levels of a mesh: the mesh itself; meshes simplified (ProgressiveMesh) to errors of a thousandth to a
/// hundredth of its size, into which the levels morph; and an impostor. Levels that save few triangles are omitted. The
/// error of absence is the mesh's size. A mesh of many triangles also has continuous levels (ObjectModel::continuous).
/// In a mesh with texture coordinates the errors also limit how far the texture is displaced (texture_shift_m()), seams
/// are kept, and there are no continuous levels.
///
/// @param has_impostor false: in place of the impostor there are meshes with errors up to a tenth of the mesh's size
///
/// Fails: invalid_argument as ProgressiveMesh::create(), and for a mesh without extent
Result<ObjectLevels> make_object_levels(const TriangleMesh& mesh, bool has_impostor = true);

/// Makes levels of an artist's meshes, finest first. The error of a level is the certified Hausdorff distance between
/// its surface and the finest mesh (bound_surface_distance()), but at least kLeastLevelRatio times the error of the
/// level before. Levels cross-fade. One mesh alone gets levels as above.
///
/// @param meshes each with fewer triangles than the one before; materials of all are indices of one list
///
/// Fails: invalid_argument, naming the level, for no mesh, for one that TriangleMesh::validate() refuses or without
///        triangles, and for one that saves no triangle
Result<ObjectLevels> make_object_levels(std::span<const TriangleMesh> meshes,
                                        bool has_impostor = true);

}  // namespace terrane
