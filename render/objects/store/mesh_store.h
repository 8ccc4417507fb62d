// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/render/object_settings.h>
#include <terrane/scene/mesh_clusters.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/aabb.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// A vertex of an object on the device: attributes 0 to 2 of instance.vert.
struct ObjectVertex {
    float position[3] = {};
    float normal[3] = {};
    std::uint8_t colour[4] = {};
};
static_assert(sizeof(ObjectVertex) == 28);

/// A mesh on the device.
struct StoredMesh {
    struct Level {
        std::uint32_t first_index = 0, index_count = 0;
        GlBuffer targets;  ///< of its vertices in the next level; no buffer: it does not morph
        /// Their order is that of the indices; none of meshes that are two-sided or small.
        std::optional<MeshClusters> clusters;
    };
    std::vector<ObjectVertex> vertices;  ///< kept for objects whose vertices move
    GlBuffer vertex_buffer, index_buffer;
    std::vector<Level> levels;
    Aabb bounds;  ///< of the positions
    bool is_two_sided = false;
    std::size_t bytes = 0;  ///< on the device
};

/// Normals of vertices from the triangles around them, weighted by area; +z where there are none.
std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh);

/// Keeps meshes of objects on the device.
class MeshStore {
public:
    /// Fails: invalid_argument as check(TriangleMesh), for an index of a level beyond the vertices, for a vertex of a
    ///        level that morphs without a target, and for more than 2^31 indices; device_unavailable where OpenGL
    ///        reports an error
    Result<MeshId> add(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                       const MeshMaterial& material);
    void remove(MeshId mesh) { meshes_.erase(mesh); }
    /// Null where there is none of that name.
    const StoredMesh* find(MeshId mesh) const;
    /// On the device.
    std::size_t bytes() const;

private:
    std::uint32_t next_ = 0;
    std::map<MeshId, StoredMesh> meshes_;
};

}  // namespace terrane::internal
