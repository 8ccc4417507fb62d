// SPDX-License-Identifier: MIT
#pragma once

#include "scene/mesh_files.h"
#include "scene/scene_objects.h"

#include <terrane/base/math.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/scatter.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::tools {

/// What MeshObjects::append_to() appended.
struct MeshObjectCounts {
    std::size_t objects = 0;
    std::size_t triangles = 0;
    std::size_t left_out =
        0;  ///< scattered objects whose error of absence is above the target but not the threshold
    double error_px = 0.0;  ///< bound of the screen error of every object in view, pixels
};

/// The objects of a scene as triangles of the mesh of one view, under one budget with the ground.
///
/// Each placed object is in the mesh, in view or not. A scattered object is in the mesh if it is in view and the error
/// of its absence, its size, is above the threshold. Objects have the coarsest level whose screen error is within the
/// threshold: the mesh itself, or a simplified one (ProgressiveMesh) with a certified error of up to a tenth of its
/// size. The screen error is the error in metres, times pixels per radian, over the distance from the eye to the
/// object's bounding sphere.
class MeshObjects {
public:
    /// @param source       ground of scattered objects, with its volumes: none stand where a volume replaces it
    /// @param view         valid
    /// @param max_error_px target of the screen error, pixels, > 0
    /// @param normals      of the mesh that append_to() gets. Without them, vertices of equal positions are one
    ///
    /// Fails: as ProgressiveMesh::create(), sight_range(), Scatter::create() and Scatter::objects_in(). The message
    ///        names the file of the mesh
    static Result<MeshObjects> create(std::shared_ptr<const HeightSource> source,
                                      const SceneObjects& objects, const View& view,
                                      double max_error_px, Normals normals);

    /// The triangles that the objects need at each threshold, for Triangulator::update(). Those of placed objects at
    /// their coarsest levels are demanded at every threshold.
    std::span<const TriangleDemand> demands() const { return demands_; }
    std::size_t placed_count() const { return placed_count_; }
    /// Triangles of the placed objects at their coarsest levels.
    std::size_t least_triangles() const { return least_triangles_; }

    /// Appends the objects at a threshold to a mesh, in world coordinates: placed ones in the order of the scene, then
    /// scattered ones.
    ///
    /// @param threshold_px finite, such as TerrainMesh::demand_threshold_px
    MeshObjectCounts append_to(IndexedMesh& mesh, double threshold_px) const;

private:
    /// A mesh with its levels of detail, finest first.
    struct Model {
        std::vector<TriangleMesh> levels;
        std::vector<double> errors_m;  // [levels] certified, at scale 1
        Eigen::Vector3d centre;        // of the bounding sphere
        double radius = 0.0;
        double size = 0.0;  // error of absence
    };
    struct Instance {
        Pose world_from_object;
        double scale = 1.0;
        std::uint32_t model = 0;
        double px_per_m = 0.0;  // screen error of an error of 1 m at scale 1
    };

    MeshObjects(const View& view, double max_error_px) : view_(view), max_error_px_(max_error_px) {}
    static Result<Model> make_model(const TriangleMesh& mesh, Normals normals);
    Instance make_instance(std::size_t model, const Pose& world_from_object, double scale) const;
    Result<void> add_scattered(const HeightSource& source, const SceneScatter& wanted,
                               const Scatter& scatter);
    void demand_levels(const Instance& instance);

    View view_;
    double max_error_px_;
    std::vector<Model> models_;
    std::vector<Instance> instances_;  // placed ones first
    std::size_t placed_count_ = 0;
    std::size_t least_triangles_ = 0;
    std::vector<TriangleDemand> demands_;
};

}  // namespace terrane::tools
