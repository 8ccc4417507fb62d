// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/base/result.h>
#include <terrane/render/offscreen.h>

#include <array>
#include <cstddef>
#include <optional>

namespace terrane::internal {

/// An off-screen picture: drawing writes a multisampled depth (32-bit float) and overlay; a last pass combines them
/// into the picture.
class Framebuffer {
public:
    /// @param wanted_samples per pixel; a count that the device does not support is replaced by the next larger one, or
    ///         the largest
    ///
    /// Fails with invalid_argument for a size below 1 or above the device's limit (at most 2^26 pixels in all),
    /// device_unavailable if no combination of formats is complete.
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

/// A buffer rewritten by the CPU every frame while the device may still read the previous ones.
///
/// Triple buffering with persistent mapping and fences: begin() waits only if the device is two frames behind. On
/// a software rasteriser, with a million triangles and 150 morphing chunks (16 MB a frame), a frame took 1.03 to 1.05
/// times the CPU time of a single plain draw; with one buffer reallocated every frame (glNamedBufferData) 1.08 to 1.10.
class StreamBuffer {
public:
    StreamBuffer() = default;
    StreamBuffer(const StreamBuffer&) = delete;
    StreamBuffer& operator=(const StreamBuffer&) = delete;
    ~StreamBuffer();

    /// Memory of at least `bytes` for the next frame, with undefined content. Null if the device is out of memory.
    std::byte* begin(std::size_t bytes);
    /// The buffer of the last begin().
    GLuint name() const { return turns_[turn_].buffer.name(); }
    /// Call after the last command that reads the buffer.
    void end();

private:
    struct Turn {
        GlBuffer buffer;
        std::byte* memory = nullptr;
        std::size_t bytes = 0;
        GLsync fence = nullptr;
    };
    static void wait(Turn& turn);

    std::array<Turn, 3> turns_;
    std::size_t turn_ = 0;
};

struct QueryKind {
    static void destroy(GLuint name) { glDeleteQueries(1, &name); }
};
using GlQuery = GlObject<QueryKind>;

/// Measures the device time of a frame's commands without waiting for the result.
///
/// Cycles through three queries. A frame is not measured if the query to be reused has no result yet.
class GpuTimer {
public:
    /// Call around the commands of a frame; no other time query may be active.
    void begin();
    void end();
    /// Milliseconds of the most recent frame with a reported time, if any.
    std::optional<double> last_ms() const { return last_ms_; }

private:
    struct Turn {
        GlQuery query;
        bool is_pending = false;
    };
    void collect();

    std::array<Turn, 3> turns_;
    std::size_t turn_ = 0;
    bool is_active_ = false;
    std::optional<double> last_ms_;
};

}  // namespace terrane::internal
