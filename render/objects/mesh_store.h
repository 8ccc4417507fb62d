// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/materials.h"

#include <terrane/base/math.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/mesh_clusters.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
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
    /// Triangles of one material.
    struct Group {
        std::uint32_t material = 0;  ///< index in `materials`
        std::uint32_t first_index = 0, index_count = 0;
        /// Clusters of the triangles, in the order of the indices; none for two-sided materials and few triangles.
        std::optional<MeshClusters> clusters;
    };
    struct Level {
        std::vector<Group> groups;  ///< by material
        std::uint32_t index_count = 0;
        GlBuffer
            targets;  ///< the vertices that the level's vertices move to; no buffer: the level does not morph
        GlBuffer texture_targets;  ///< their texture coordinates, if the mesh has a texture buffer
    };
    std::vector<ObjectVertex> vertices;  ///< kept for objects with moving vertices
    std::vector<std::uint16_t>
        materials_of_vertices;  ///< [vertices] for several materials, else empty
    GlBuffer vertex_buffer, index_buffer;
    GlBuffer texture_buffer;  ///< [vertices] texture coordinates; none if all materials are plain
    std::vector<StoredMaterial> materials;  ///< at least one
    std::vector<Level> levels;
    Aabb bounds;            ///< of the positions
    std::size_t bytes = 0;  ///< on the device, without textures

    /// Index in `materials`.
    std::uint32_t material_of(const TriangleMesh::Triangle& triangle) const {
        return materials_of_vertices.empty() ? 0 : materials_of_vertices[triangle[0]];
    }
};

/// Area-weighted vertex normals; +z for vertices without triangles.
std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh);

/// Keeps meshes of objects on the device.
class MeshStore {
public:
    /// @param materials at least one
    /// @param textures  receives the materials' textures
    ///
    /// Fails: invalid_argument as TriangleMesh::validate(), for a level with an index beyond the vertices, for a
    ///        morphing level in which a vertex has no target, for 2^31 indices or more, and for a material that does
    ///        not exist or is invalid; device_unavailable if OpenGL reports an error
    Result<MeshId> add(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                       std::span<const MeshMaterial> materials, TextureStore& textures);
    void remove(MeshId mesh) { meshes_.erase(mesh); }
    /// Null for an unknown id.
    const StoredMesh* find(MeshId mesh) const;
    std::size_t bytes() const;
    /// The features of all materials with textures.
    std::set<unsigned> features() const;

private:
    std::uint32_t next_ = 0;
    std::map<MeshId, StoredMesh> meshes_;
};

/// Vertex array with the attributes of ObjectVertex (0 to 2, binding 0), of ObjectInstance (3 to 5, binding 1), and of
/// the vertices that a level morphs to (6 to 8, binding 2).
GlVertexArray make_object_layout();
/// The same with texture coordinates (9, binding 3), and those of the vertices that a level morphs to (10, binding 4).
GlVertexArray make_textured_layout();

/// Binds a layout with a mesh's buffers.
///
/// @param targets buffer of the vertices that the level morphs to; 0: none
void bind_mesh(GLuint layout, const StoredMesh& mesh, GLuint targets);
/// Binds the buffers of texture coordinates to a layout of make_textured_layout().
///
/// @param targets as for bind_mesh()
void bind_texture_coordinates(GLuint layout, const StoredMesh& mesh, GLuint targets);
/// Replaces the vertex buffer of the layout by `buffer` from `byte` on; these vertices do not morph.
void bind_own_vertices(GLuint layout, GLuint buffer, std::size_t byte);

/// An impostor on the device: views of a mesh.
struct StoredImpostor {
    ImpostorSettings settings;
    Eigen::Vector3f centre =
        Eigen::Vector3f::Zero();  ///< centre of the bounds, object's frame, metres
    float half_width = 0.0f;      ///< largest distance of a vertex from the central z axis, metres
    float half_height = 0.0f;     ///< metres
    float radius = 0.0f;          ///< of the bounding sphere, metres: half the range of depths
    /// A layer for each view, the horizontal ring first. RGB: square root of linear colour, times opacity; A: opacity.
    GlTexture colours;
    GlTexture
        shapes;  ///< normal (0.5 + 0.5 n) and depth (0.5 + 0.5 towards the viewer / radius), times opacity
    std::size_t bytes = 0;
};

/// Programs that draw a textured mesh into an impostor's view.
MaterialPrograms bake_programs();

/// Renders impostors: a mesh is drawn from each direction in parallel projection, unlit, at four times the size of a
/// view, and averaged.
///
/// Source: P. Maciel, P. Shirley. Visual Navigation of Large Environments Using Textured Clusters. I3D 1995
///         (impostors).
class ImpostorStore {
public:
    /// Fails: invalid_argument for settings out of range or a mesh without triangles; device_unavailable if OpenGL
    ///        reports an error
    Result<ImpostorId> add(const StoredMesh& mesh, const ImpostorSettings& settings);
    void remove(ImpostorId impostor) { impostors_.erase(impostor); }
    const StoredImpostor* find(ImpostorId impostor) const;
    std::size_t bytes() const;

private:
    Result<void> make_programs(const StoredMesh& mesh);
    void draw_view(const StoredMesh& mesh, const Eigen::Vector3f& centre,
                   const Eigen::Matrix3f& axes) const;

    GlProgram program_;
    GLint centre_ = -1, axes_ = -1;
    GlVertexArray layout_, textured_layout_;
    MaterialPrograms material_programs_ = bake_programs();
    std::uint32_t next_ = 0;
    std::map<ImpostorId, StoredImpostor> impostors_;
};

}  // namespace terrane::internal
