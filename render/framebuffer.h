// SPDX-License-Identifier: MIT
#pragma once

#include "gl_object.h"

#include <terrane/render/image.h>
#include <terrane/terrain/result.h>

namespace terrane::internal {

/// An off-screen picture with multisampled colour and 32-bit float depth, and the resolved one.
class Framebuffer {
public:
    /// Takes the wanted samples a pixel, fewer where the device has fewer.
    ///
    /// Fails with invalid_argument for a size below 1 or above what the device takes (at most 2^26
    /// pixels together), device_unavailable where no combination of formats is complete.
    static Result<Framebuffer> create(int width_px, int height_px, int wanted_samples);

    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int sample_count() const { return sample_count_; }

    /// Makes it the target of drawing, viewport included.
    void bind() const;
    /// Averages the samples; read() gives what was drawn before.
    void resolve() const;
    Image read() const;

private:
    Framebuffer() = default;
    int width_px_ = 0, height_px_ = 0, sample_count_ = 0;
    GlRenderbuffer colour_, depth_, resolved_colour_;
    GlFramebuffer drawn_, resolved_;
};

}  // namespace terrane::internal
