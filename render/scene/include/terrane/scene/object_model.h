// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/mesh_rays.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/aabb.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/result.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace terrane {

/// A level of detail of an object: a mesh or an impostor.
struct ObjectLevel {
    /// Upper bound of the geometric error, metres at scale 1, >= 0: of a mesh the two-sided Hausdorff
    /// distance, of an impostor the largest displacement of its picture.
    double error_m = 0.0;
    std::uint32_t triangles = 0;   ///< of one instance, >= 1; 2 of an impostor
    std::uint32_t mesh_level = 0;  ///< MeshDraw::level; ignored where is_impostor
    bool is_impostor = false;      ///< drawn by ObjectModel::impostor
    /// Changes into the next level, a mesh too, by a morph in place of a fade: one draw of this level's triangles,
    /// whose vertices move (MeshLevel::morph_targets).
    bool morphs = false;
};

/// A model: an object with its levels of detail, for any number of placements.
struct ObjectModel {
    MeshId mesh{};                       ///< of the renderer
    std::optional<ImpostorId> impostor;  ///< needed where a level is an impostor
    Aabb bounds;                         ///< of the mesh, in the object's frame, metres
    /// Finest first, at least one. Errors increase by at least the factor of 2 from level to level, the first one may
    /// be 0; triangles decrease.
    std::vector<ObjectLevel> levels;
    /// Geometric error where the object is not drawn, metres at scale 1, at least twice that of the last level: for
    /// instance its height. Infinity: it is always drawn.
    double absence_error_m = 0.0;
    /// The mesh for Scene::ray(), within the bounds; none: rays do not meet it.
    std::optional<MeshRays> rays = {};
    /// Continuous levels of detail, which the nearest objects have in place of the meshes among `levels`: the vertices
    /// and the finest triangles are those of `mesh`, and no impostor is finer than a mesh. Scene reads the record of
    /// contractions alone, not the present level, which must not change meanwhile. Null: none.
    std::shared_ptr<const ProgressiveMesh> continuous = {};
};

/// Least ratio of the errors of consecutive levels.
inline constexpr double kLeastLevelRatio = 2.0;

/// Fails: invalid_argument, naming the level and the value, for one that is not as described above
Result<void> check(const ObjectModel& model);

}  // namespace terrane
