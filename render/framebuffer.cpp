// SPDX-License-Identifier: MIT
#include "framebuffer.h"

#include "gl_error.h"

#include <algorithm>
#include <array>
#include <string>

namespace terrane::internal {
namespace {

// Four samples of colour and depth of that many pixels take 2 GiB.
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;

Result<void> check_size(int width_px, int height_px) {
    GLint side = 0;
    std::array<GLint, 2> viewport{};
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &side);
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
    const std::string got = std::to_string(width_px) + " x " + std::to_string(height_px);
    if (width_px < 1 || height_px < 1) {
        return fail(ErrorCode::invalid_argument,
                    "the picture must have at least 1 x 1 pixels, got " + got);
    }
    if (width_px > std::min(side, viewport[0]) || height_px > std::min(side, viewport[1])) {
        return fail(ErrorCode::invalid_argument,
                    "the device draws at most " + std::to_string(std::min(side, viewport[0])) +
                        " x " + std::to_string(std::min(side, viewport[1])) + " pixels, got " +
                        got);
    }
    if (std::int64_t{width_px} * height_px > kMaxPixels) {
        return fail(
            ErrorCode::invalid_argument,
            "the picture must have at most " + std::to_string(kMaxPixels) + " pixels, got " + got);
    }
    return {};
}

}  // namespace

Result<Framebuffer> Framebuffer::create(int width_px, int height_px, int wanted_samples) {
    if (const Result<void> good = check_size(width_px, height_px); !good) {
        return tl::unexpected(good.error());
    }
    GLint max_samples = 1;
    glGetIntegerv(GL_MAX_SAMPLES, &max_samples);

    Framebuffer made;
    made.width_px_ = width_px;
    made.height_px_ = height_px;
    made.resolved_colour_ = make_renderbuffer();
    glNamedRenderbufferStorage(made.resolved_colour_.name(), GL_RGBA8, width_px, height_px);
    made.resolved_ = make_framebuffer();
    glNamedFramebufferRenderbuffer(made.resolved_.name(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   made.resolved_colour_.name());
    GLenum status = glCheckNamedFramebufferStatus(made.resolved_.name(), GL_FRAMEBUFFER);

    GLenum drawn_status = GL_FRAMEBUFFER_UNSUPPORTED;
    for (int samples = std::min<int>(wanted_samples, max_samples); samples >= 1; samples /= 2) {
        made.sample_count_ = samples;
        // storage of zero samples is what a plain renderbuffer has
        const int stored = samples > 1 ? samples : 0;
        made.colour_ = make_renderbuffer();
        made.depth_ = make_renderbuffer();
        glNamedRenderbufferStorageMultisample(made.colour_.name(), stored, GL_RGBA8, width_px,
                                              height_px);
        glNamedRenderbufferStorageMultisample(made.depth_.name(), stored, GL_DEPTH_COMPONENT32F,
                                              width_px, height_px);
        made.drawn_ = make_framebuffer();
        glNamedFramebufferRenderbuffer(made.drawn_.name(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                       made.colour_.name());
        glNamedFramebufferRenderbuffer(made.drawn_.name(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                       made.depth_.name());
        drawn_status = glCheckNamedFramebufferStatus(made.drawn_.name(), GL_FRAMEBUFFER);
        if (drawn_status == GL_FRAMEBUFFER_COMPLETE) break;
    }
    if (const Result<void> good = check_gl("make the picture"); !good) {
        return tl::unexpected(good.error());
    }
    if (status == GL_FRAMEBUFFER_COMPLETE) status = drawn_status;
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        return fail(ErrorCode::device_unavailable,
                    "the device offers no picture of 8-bit colour and 32-bit depth, status " +
                        std::to_string(status));
    }
    made.bind();
    glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    made.resolve();
    return made;
}

void Framebuffer::bind() const {
    glBindFramebuffer(GL_FRAMEBUFFER, drawn_.name());
    glViewport(0, 0, width_px_, height_px_);
}

void Framebuffer::resolve() const {
    glBlitNamedFramebuffer(drawn_.name(), resolved_.name(), 0, 0, width_px_, height_px_, 0, 0,
                           width_px_, height_px_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

Image Framebuffer::read() const {
    Image image;
    image.width = width_px_;
    image.height = height_px_;
    const std::size_t row_bytes = static_cast<std::size_t>(width_px_) * 3;
    image.rgb.resize(row_bytes * static_cast<std::size_t>(height_px_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.name());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
    // OpenGL's first row is the lowest
    for (std::size_t low = 0, high = static_cast<std::size_t>(height_px_) - 1; low < high;
         ++low, --high) {
        std::swap_ranges(image.rgb.begin() + static_cast<std::ptrdiff_t>(low * row_bytes),
                         image.rgb.begin() + static_cast<std::ptrdiff_t>((low + 1) * row_bytes),
                         image.rgb.begin() + static_cast<std::ptrdiff_t>(high * row_bytes));
    }
    return image;
}

}  // namespace terrane::internal
