// SPDX-License-Identifier: MIT
#pragma once

#include "gl/framebuffer.h"
#include "gl/shader.h"
#include "light/ground_light.h"

#include <memory>
#include <string>

namespace terrane::internal {

/// Deferred shading of a frame: the ground from its depth, the sky, and the overlay over them.
class GroundShade {
public:
    /// @param sample_count of the framebuffers passed to draw()
    /// @param lighting     text that goes before shade.frag: defines lit_at() and shown_at()
    ///
    /// Fails with device_unavailable where its shaders do not compile.
    static Result<GroundShade> create(int sample_count,
                                      const std::string& lighting = light_text({}));

    /// Call before draw(), where there is ground. Fails with device_unavailable.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye) {
        return light_->prepare(resident, view, eye);
    }

    /// Computes the colours of a picture from its depth and overlay, with the bound uniforms.
    void draw(const Framebuffer& picture, bool has_overlay) const;

    /// Binds the noise of the ground to a texture unit: 1 for shade.frag and solid.frag, 7 for water.glsl.
    void bind_noise(GLuint unit) const { glBindTextureUnit(unit, noise_.name()); }

    /// Call after the last draw() of a prepared frame.
    void finish() { light_->finish(); }

    const GroundLight& light() const { return *light_; }

private:
    GroundShade() = default;

    std::unique_ptr<GroundLight> light_ = std::make_unique<GroundLight>();
    GlProgram plain_, with_overlay_;
    GlTexture noise_;
    GlVertexArray no_layout_;
};

}  // namespace terrane::internal
