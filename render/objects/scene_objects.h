// SPDX-License-Identifier: MIT
#pragma once

#include "gl/frame_resources.h"
#include "objects/gpu_instances.h"
#include "objects/mesh_store.h"
#include "objects/object_casters.h"
#include "objects/object_draws.h"

#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Draws the objects of a scene. Programs are created with the first mesh or particle; until then nothing is on the
/// device.
class SceneObjects {
public:
    /// @param sample_count  of the picture
    /// @param lighting      text prepended to shaders: defines lit_at() and shown_at()
    /// @param texture_bytes, is_anisotropic see TextureStore
    SceneObjects(int sample_count, std::string lighting, std::size_t texture_bytes,
                 bool is_anisotropic)
        : sample_count_(sample_count),
          lighting_(std::move(lighting)),
          textures_(texture_bytes, is_anisotropic) {}

    /// Replaces `lighting`; keeps it if the programs of what there is do not compile: device_unavailable.
    Result<void> set_lighting(const std::string& lighting);

    Result<MeshId> add_mesh(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                            std::span<const MeshMaterial> materials);
    Result<ImpostorId> add_impostor(MeshId mesh, const ImpostorSettings& settings);
    void remove_mesh(MeshId mesh) { meshes_.remove(mesh); }
    void remove_impostor(ImpostorId impostor) { impostors_.remove(impostor); }
    Result<ParticleImageId> add_particle_image(std::shared_ptr<const TextureImage> image);
    void remove_particle_image(ParticleImageId image) { particle_images_.erase(image); }

    /// What culls instances on the device, made by the first call. Fails as GpuInstances::create()
    ///
    /// @param is_hosted in a host's context
    Result<GpuInstances*> instance_device(bool is_hosted);

    /// Checks a frame's draws, and uploads what changes from frame to frame.
    ///
    /// @param cascades maps for draw_casters(); empty: no shadows, and casters out of view are ignored
    ///
    /// Fails: invalid_argument, naming the item, for a number that is not finite, a scale or radius that is not above
    ///        0, a coverage outside -1 to 2, a mesh, level, impostor, image or range of instances that does not exist,
    ///        and streamed positions or triangles that do not fit the mesh; device_unavailable if OpenGL fails
    Result<void> prepare(const SceneDraws& draws, const View& view,
                         std::span<const SunCascade> cascades = {});
    bool is_empty() const {
        return solid_.empty() && impostor_draws_.empty() && particle_count_ == 0;
    }

    /// Draws meshes and impostors into the bound target.
    void draw_solid() const;
    /// Draws the shadow casters of a cascade into its map, which must be the bound target.
    void draw_casters(std::size_t cascade) const;
    /// Blends particles over the overlay; reads the depth of the picture.
    void draw_particles(const Framebuffer& picture) const;
    /// Call after the last draw of a frame.
    void finish();

    /// Drawn objects, excluding casters out of view.
    std::size_t object_count() const { return object_count_; }
    std::size_t triangle_count() const { return triangle_count_; }
    /// Part of triangle_count(): triangles in back-facing clusters, not submitted.
    std::size_t culled_triangle_count() const { return parts_.culled_triangles(); }
    /// Bytes of meshes, textures, impostors and instances on the device.
    std::size_t bytes() const {
        return meshes_.bytes() + textures_.bytes() + impostors_.bytes() +
               (instances_ ? instances_->bytes() : 0);
    }
    std::size_t reduced_texture_count() const { return textures_.reduced_count(); }

private:
    /// Successive particles with one image.
    struct ParticleRun {
        StoredTexture* image = nullptr;  // null: soft discs
        std::size_t first = 0, count = 0;
    };

    Result<void> make_programs();
    Result<void> prepare_casters(const SceneDraws& draws, const View& view,
                                 std::span<const SunCascade> cascades);
    Result<void> collect(const SceneDraws& draws, bool has_casters);
    Result<void> add_meshes(std::span<const MeshDraw> meshes, std::size_t instance_count,
                            const DeviceInstances* device);
    Result<void> add_impostors(std::span<const ImpostorDraw> impostors, std::size_t instance_count,
                               const DeviceInstances* device);
    Result<void> add_on_device(const SceneDraws& draws);
    Result<void> add_streamed(const SceneDraws& draws, const StreamedDraw& streamed);
    Result<void> add_particles(std::span<const Particle> particles);
    static void copy_triangles(const OpaqueDraw& draw, const StreamedDraw& streamed,
                               std::byte* memory);
    Result<void> upload(const SceneDraws& draws);
    Result<void> prepare_textures();
    void draw_mesh(const OpaqueDraw& draw, GLuint layout) const;
    void sort_billboards(const SceneDraws& draws, std::byte* memory);
    void draw_billboards() const;
    std::span<const OpaqueDraw> drawn_solids() const {
        return std::span(solid_).first(drawn_solids_);
    }
    std::span<const BillboardDraw> drawn_impostors() const {
        return std::span(impostor_draws_).first(drawn_impostors_);
    }

    int sample_count_;
    std::string lighting_;
    std::optional<ObjectPrograms> programs_;
    std::unique_ptr<ObjectCasters> casters_;  // null before the first shadow
    TextureStore textures_;
    MeshStore meshes_;
    ImpostorStore impostors_;
    std::unique_ptr<GpuInstances> instances_;  // null before instance_device()
    std::map<ParticleImageId, std::shared_ptr<StoredTexture>> particle_images_;
    std::uint32_t last_image_ = 0;
    StreamBuffer stream_;
    OpaqueParts parts_;
    GLint subpixel_bits_ = 0;  // 0: not queried yet

    // State of the current frame.
    double pixels_per_radian_ = 0.0;
    std::vector<OpaqueDraw> solid_;              // visible ones, then casters out of view
    std::vector<BillboardDraw> impostor_draws_;  // in the same order
    std::size_t drawn_solids_ = 0, drawn_impostors_ = 0;
    std::vector<const StreamedDraw*> streamed_;  // sources of the last drawn_solids(), in order
    bool has_textures_ = false;                  // whether a drawn solid has
    std::size_t billboard_byte_ = 0, billboard_count_ = 0;
    std::size_t particle_byte_ = 0, particle_count_ = 0;
    std::vector<ParticleRun> particle_runs_;
    std::size_t command_byte_ = 0;
    std::size_t object_count_ = 0, triangle_count_ = 0;
};

}  // namespace terrane::internal
