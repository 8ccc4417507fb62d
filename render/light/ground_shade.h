// SPDX-License-Identifier: MIT
#pragma once

#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "light/light_levels.h"

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Device data for shading the ground. Each chunk selected by LightLevels has one layer in two texture arrays, which
/// hold its slope map and its nodes. A hash table maps the level and position of a chunk to its layer.
class GroundLight {
public:
    /// @param has_bends whether chunks have bend maps too, which the ground's materials need
    explicit GroundLight(bool has_bends);

    /// Call once a frame, before bind(). Fails with device_unavailable if the device is out of memory.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye);

    /// Binds slopes, nodes, table and bends to texture units 0, 4, 5 and 13, and the uniform block to binding 1.
    void bind() const;
    /// Call after the frame's last command that reads the table or the uniform block.
    void finish();

    /// Bytes of the slope and bend maps of resident chunks.
    std::size_t bytes() const;
    const LightLevels& levels() const { return levels_; }

private:
    struct Layer {
        std::weak_ptr<const Chunk> chunk;
        SideLevels side_levels{};
        LightNodes nodes{};
    };

    void hold_layers(std::size_t count);
    void upload(const ResidentSet& resident);
    Result<void> write_table(const Lattice& lattice, const EyeFrame& eye);

    bool has_bends_;
    LightLevels levels_;
    std::vector<Layer> layers_;
    GlTexture slopes_, bends_, nodes_, table_;
    StreamBuffer stream_;
};

/// Deferred shading of a frame: colours the ground (from its depth) and the sky, and blends the overlay over both.
class GroundShade {
public:
    /// @param sample_count of the framebuffers passed to draw()
    /// @param lighting     text prepended to shade.frag: defines lit_at() and shown_at()
    /// @param is_smoothed  of the framebuffers passed to draw()
    /// @param has_materials whether `lighting` has materials; with 1 sample per pixel the framebuffers have blocks
    ///
    /// Fails with device_unavailable if its shaders do not compile.
    static Result<GroundShade> create(int sample_count,
                                      const std::string& lighting = light_text({}),
                                      bool is_smoothed = false, bool has_materials = false);

    /// The programs that shade a picture, one or one for each class of blocks.
    struct Programs {
        std::vector<GlProgram> plain, with_overlay;
    };
    /// Programs with another `lighting` for use(). Fails as create()
    Result<Programs> make_programs(const std::string& lighting) const;
    void use(Programs programs) { programs_ = std::move(programs); }

    /// Call before draw() if the frame has ground. Fails with device_unavailable.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye) {
        return light_->prepare(resident, view, eye);
    }

    /// Shades a picture from its depth and overlay, with the bound uniforms, and smooths its edges if it is smoothed.
    void draw(const Framebuffer& picture, bool has_overlay) const;

    /// Binds the ground noise to a texture unit: 1 for shade.frag and solid.frag, 7 for water.glsl.
    void bind_noise(GLuint unit) const { glBindTextureUnit(unit, noise_.name()); }

    /// Call after the last draw() of a prepared frame.
    void finish() { light_->finish(); }

    const GroundLight& light() const { return *light_; }

private:
    GroundShade() = default;

    std::unique_ptr<GroundLight> light_;
    std::string defines(bool has_overlay) const;

    int sample_count_ = 1;
    bool is_smoothed_ = false, has_blocks_ = false;
    Programs programs_;
    GlProgram classes_, classes_with_overlay_, copying_, smoothing_;
    GlTexture noise_;
    GlVertexArray no_layout_;
};

}  // namespace terrane::internal
