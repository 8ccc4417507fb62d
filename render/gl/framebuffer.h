// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/render/image.h>
#include <terrane/terrain/result.h>

namespace terrane::internal {

/// An off-screen picture: what is drawn goes to a depth (32-bit float) and an overlay of some samples a
/// pixel; a last pass makes the picture of both.
class Framebuffer {
public:
    /// Takes the wanted samples a pixel, or what the device has: fewer, or the next more.
    ///
    /// Fails with invalid_argument for a size below 1 or above what the device takes (at most 2^26
    /// pixels together), device_unavailable where no combination of formats is complete.
    static Result<Framebuffer> create(int width_px, int height_px, int wanted_samples);

    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int sample_count() const { return sample_count_; }

    /// Makes depth, or depth and overlay, the target of drawing, viewport included.
    void bind_depth() const;
    void bind_depth_and_overlay() const;
    /// Makes the picture itself the target; depth and overlay may be read.
    void bind_colours() const;
    GLuint depth_texture() const { return depth_.name(); }
    /// rgb times alpha; it lies over ground and sky.
    GLuint overlay_texture() const { return overlay_.name(); }
    Image read() const;

private:
    Framebuffer() = default;
    void bind(const GlFramebuffer& target) const;
    int width_px_ = 0, height_px_ = 0, sample_count_ = 0;
    GlTexture depth_, overlay_;
    GlRenderbuffer colours_;
    GlFramebuffer depth_target_, overlay_target_, picture_;
};

}  // namespace terrane::internal
