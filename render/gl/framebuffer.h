// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/render/image.h>
#include <terrane/terrain/result.h>

namespace terrane::internal {

/// An off-screen picture: drawing writes a multisampled depth (32-bit float) and overlay; a last pass combines them
/// into the picture.
class Framebuffer {
public:
    /// @param wanted_samples per pixel; a count that the device does not have is replaced by the next larger one, or
    ///         the largest
    ///
    /// Fails with invalid_argument for a size below 1 or above what the device takes (at most 2^26
    /// pixels together), device_unavailable where no combination of formats is complete.
    static Result<Framebuffer> create(int width_px, int height_px, int wanted_samples);

    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int sample_count() const { return sample_count_; }

    /// Binds depth, or depth and overlay, as the target, and sets the viewport.
    void bind_depth() const;
    void bind_depth_and_overlay() const;
    /// Binds the overlay alone; depth may be read.
    void bind_overlay() const;
    /// Binds the picture as the target; depth and overlay may be read.
    void bind_colours() const;
    GLuint depth_texture() const { return depth_.name(); }
    /// Premultiplied colour over ground and sky.
    GLuint overlay_texture() const { return overlay_.name(); }
    Image read() const;

private:
    Framebuffer() = default;
    void bind(const GlFramebuffer& target) const;
    int width_px_ = 0, height_px_ = 0, sample_count_ = 0;
    GlTexture depth_, overlay_;
    GlRenderbuffer colours_;
    GlFramebuffer depth_target_, overlay_target_, overlay_alone_, picture_;
};

}  // namespace terrane::internal
