// SPDX-License-Identifier: MIT
#pragma once

#include "gl/framebuffer.h"
#include "light/ground_light.h"
#include "shadow/shadow_maps.h"

#include <memory>
#include <string>

namespace terrane::internal {

/// Deferred shading of a frame: the ground from its depth, the sky, and the overlay over them.
class GroundShade {
public:
    /// @param sample_count of the framebuffers passed to draw()
    /// @param lighting     text that goes before shade.frag: defines lit_at()
    ///
    /// Fails with device_unavailable where its shaders do not compile.
    static Result<GroundShade> create(int sample_count,
                                      const std::string& lighting = shadow_text(false));

    /// Call before draw(), where there is ground. Fails with device_unavailable.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye) {
        return light_->prepare(resident, view, eye);
    }

    /// Computes the colours of a picture from its depth and overlay, with the bound uniforms.
    void draw(const Framebuffer& picture, bool has_overlay) const;

    /// Binds the noise of the ground to texture unit 1, as shade.frag and solid.frag use it.
    void bind_noise() const { glBindTextureUnit(1, noise_.name()); }

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
