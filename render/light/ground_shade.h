// SPDX-License-Identifier: MIT
#pragma once

#include "gl/framebuffer.h"
#include "light/ground_light.h"

#include <memory>

namespace terrane::internal {

/// Colours a frame: the ground from its depth, the sky, and what was drawn over them.
class GroundShade {
public:
    /// @param sample_count of the framebuffers that it will be used with
    /// Fails with device_unavailable where its shaders are refused.
    static Result<GroundShade> create(int sample_count);

    /// Before draw(), where there is ground. Fails with device_unavailable.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye) {
        return light_->prepare(resident, view, eye);
    }

    /// From the depth (and the overlay, where there is one) of a picture to its colours, with the uniforms
    /// that are bound.
    void draw(const Framebuffer& picture, bool has_overlay) const;

    /// After the last draw() of a frame that was prepared.
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
