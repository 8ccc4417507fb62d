// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/mesh_store.h"

#include <terrane/base/result.h>
#include <terrane/scene/mesh_clusters.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::internal {

/// Triangles of one mesh and one material for a range of a frame's instances.
struct OpaqueDraw {
    const StoredMesh* mesh = nullptr;
    const StoredMaterial* material = nullptr;
    GLuint targets = 0;          ///< buffer of morph targets; 0: none
    GLuint texture_targets = 0;  ///< of their texture coordinates
    bool is_first = true;  ///< no earlier draw is of the same instances, with another material
    bool has_own_vertices = false, has_own_indices = false;  ///< in the frame's stream buffer
    std::size_t vertex_byte = 0, index_byte = 0;
    std::uint32_t index_count = 0, first_instance = 0, instance_count = 0;
    GLuint device_instances = 0;             ///< buffer of the instances; 0: the frame's stream
    const MeshClusters* clusters = nullptr;  ///< of the triangles; null: all are drawn
    bool has_parts = false;                  ///< drawn by commands of OpaqueParts
    std::uint32_t first_part = 0, part_count = 0;  ///< range of these commands
};

/// The billboards of an impostor. Their instances are copied to a separate range with the small ones first; those on a
/// device are in that order.
struct BillboardDraw {
    const StoredImpostor* impostor = nullptr;
    std::uint32_t first_instance = 0, instance_count = 0;
    std::uint32_t first_copy = 0, small_count = 0;
    GLuint device_instances = 0;  ///< buffer of the instances; 0: the frame's stream
};

/// A program that draws billboards of an impostor, and its uniforms.
struct ImpostorProgram {
    GlProgram program;
    GLint first_instance = -1, centre = -1, half_box = -1, views = -1, radius = -1, texels = -1;

    /// Sets the uniforms of the current program.
    void set(const StoredImpostor& impostor, std::uint32_t first) const;
};
/// Fails: device_unavailable if the program does not compile
Result<ImpostorProgram> make_impostor_program(const std::string& name, std::string_view vertex,
                                              std::string_view fragment);

/// Programs that draw textured meshes.
///
/// @param before text prepended to the fragment shader: defines SAMPLES, lit_at() and shown_at()
MaterialPrograms textured_programs(const std::string& before);

/// The programs that draw a scene's objects.
struct ObjectPrograms {
    GlProgram meshes, particles;
    GlProgram image_particles;        ///< none before make_image_particles()
    ImpostorProgram impostors;        ///< blend views, displaced by their depth
    ImpostorProgram small_impostors;  ///< of few pixels: the nearest view only
    MaterialPrograms textured = textured_programs({});
    GlVertexArray object_layout, textured_layout, no_layout;

    /// Fails: device_unavailable if a program does not compile
    ///
    /// @param sample_count of the picture
    /// @param lighting     text prepended to shaders: defines lit_at() and shown_at()
    static Result<ObjectPrograms> create(int sample_count, const std::string& lighting);
    /// Makes the program for particles with images, if there is none. Fails as create()
    Result<void> make_image_particles(int sample_count, const std::string& lighting);
};

/// A command of glMultiDrawElementsIndirect().
struct PartCommand {
    std::uint32_t index_count = 0, instance_count = 0, first_index = 0;
    std::int32_t base_vertex = 0;
    std::uint32_t first_instance = 0;
};
static_assert(sizeof(PartCommand) == 20);

/// Splits the draws of clustered meshes into commands that omit back-facing clusters.
///
/// Triangles keep their order. An instance is drawn whole if it morphs, if the near plane may clip it, or if few
/// triangles would be omitted.
class OpaqueParts {
public:
    /// Replaces the commands of the previous frame. Draws without clusters get no commands.
    ///
    /// @param solids        `has_parts`, `first_part` and `part_count` are set
    /// @param subpixel_bits of the device's window coordinates: GL_SUBPIXEL_BITS
    void prepare(std::span<OpaqueDraw> solids, std::span<const ObjectInstance> instances,
                 const View& view, int subpixel_bits);

    void clear();
    std::span<const PartCommand> commands() const { return commands_; }
    /// Number of triangles that the commands omit.
    std::size_t culled_triangles() const { return culled_triangles_; }

private:
    void add_instance(const OpaqueDraw& draw, const ObjectInstance& instance, std::uint32_t number,
                      const View& view);
    void add_whole(const OpaqueDraw& draw, std::uint32_t number);

    double angle_error_ = 0.0;  // radians, of window coordinates
    std::size_t first_of_draw_ = 0;
    std::vector<PartCommand> commands_;
    std::vector<TriangleRun> runs_;
    std::size_t culled_triangles_ = 0;
};

}  // namespace terrane::internal
