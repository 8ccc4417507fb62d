// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace terrane {

/// First intersection of a segment with a mesh.
struct MeshHit {
    double fraction = 0.0;  ///< 0 at the segment's start, 1 at its end
    std::uint32_t triangle =
        0;  ///< index in TriangleMesh::triangles; the smallest one if several are hit at the same point
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, of the triangle, against the segment's direction
};

/// A triangle mesh for ray queries. Immutable; copies share their data.
///
/// Threads: any number at once
class MeshRays {
public:
    /// Rays never hit triangles without area.
    ///
    /// Fails:     invalid_argument as TriangleMesh::validate()
    /// Allocates: about 200 bytes a triangle
    /// Cost:      O(n log n)
    static Result<MeshRays> create(const TriangleMesh& mesh);

    /// The first triangle that a segment hits, from either side. A segment through an edge or a vertex hits the
    /// adjacent triangles, so that it cannot pass between two of them.
    ///
    /// @param from, to ends of the segment in the mesh's frame; nothing is hit if they are not finite
    ///
    /// Cost:   O(log n) for most segments; O(n) at worst
    /// Source: S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013. Deviation: an edge
    ///         function of 0 counts as a hit, instead of being computed again at higher precision
    std::optional<MeshHit> ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

private:
    struct Data;
    explicit MeshRays(std::shared_ptr<const Data> data);
    std::shared_ptr<const Data> data_;
};

/// A level of detail of an object: a mesh or an impostor.
struct ObjectLevel {
    /// Upper bound of the geometric error, metres at scale 1, >= 0: for a mesh the two-sided Hausdorff distance, for an
    /// impostor the largest displacement of its picture.
    double error_m = 0.0;
    std::uint32_t triangles = 0;   ///< of one instance, >= 1; 2 for an impostor
    std::uint32_t mesh_level = 0;  ///< MeshDraw::level; ignored for an impostor
    bool is_impostor = false;      ///< drawn by ObjectModel::impostor
    /// Whether the change to the next level is a geomorph instead of a cross-fade: one draw of this level's triangles,
    /// whose vertices move (MeshLevel::morph_targets). Requires that both levels are meshes.
    bool morphs = false;
};

/// A model: an object with its levels of detail, for any number of placements.
struct ObjectModel {
    MeshId mesh{};                       ///< of the renderer
    std::optional<ImpostorId> impostor;  ///< required if a level is an impostor
    Aabb bounds;                         ///< of the mesh, in the object's frame, metres
    /// Finest first, at least one. Errors increase by at least a factor of 2 from level to level; the first may be 0.
    /// Triangle counts decrease.
    std::vector<ObjectLevel> levels;
    /// Geometric error of omitting the object, metres at scale 1; for instance the object's height. At least twice the
    /// last level's error. Infinity: the object is always drawn.
    double absence_error_m = 0.0;
    /// The mesh for Scene::ray(), within the bounds; none: rays pass through the object.
    std::optional<MeshRays> rays = {};
    /// Continuous levels of detail, which replace the meshes among `levels` for the nearest objects; null: none. They
    /// must have the vertices and finest triangles of `mesh`, and no impostor may be finer than a mesh. Scene reads
    /// only the sequence of contractions; the current level must not change while Scene uses the model.
    std::shared_ptr<const ProgressiveMesh> continuous = {};

    /// Fails: invalid_argument, naming the level and the value, if a field violates its description
    Result<void> validate() const;
};

/// Least ratio of the errors of consecutive levels.
inline constexpr double kLeastLevelRatio = 2.0;

}  // namespace terrane
