// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/base/result.h>
#include <terrane/render/offscreen.h>

#include <array>
#include <cstddef>
#include <optional>

namespace terrane::internal {

/// An off-screen picture. Frames are drawn into two multisampled textures: depth (32-bit float) and overlay (8-bit
/// RGBA). A last pass combines both into the picture.
class Framebuffer {
public:
    /// @param wanted_samples samples per pixel; an unsupported count is replaced by the next larger one, or the largest
    /// @param smooths_edges  whether a pass smooths the picture's edges if there is 1 sample per pixel
    /// @param has_blocks     whether a fragment of the shading pass has a block of two by two pixels if there is 1
    ///                       sample per pixel
    ///
    /// Fails with invalid_argument for a width or height below 1 or above the device's limit, and for more than 2^26
    /// pixels in all; with device_unavailable if no combination of formats is complete.
    static Result<Framebuffer> create(int width_px, int height_px, int wanted_samples,
                                      bool smooths_edges = false, bool has_blocks = false);

    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int sample_count() const { return sample_count_; }

    /// Binds depth, or depth and overlay, as the target, and sets the viewport.
    void bind_depth() const;
    void bind_depth_and_overlay() const;
    /// Binds the overlay alone as the target; shaders may then read the depth texture.
    void bind_overlay() const;
    /// Binds the target of the shading pass: the picture, or shaded_texture(); shaders may then read the depth and
    /// overlay textures.
    void bind_colours() const;
    bool is_smoothed() const { return is_smoothed_; }
    bool has_blocks() const { return block_classes_.name() != 0; }
    /// Binds the picture as the target of the pass that follows shading if it is smoothed or has blocks.
    void bind_smoothed() const;
    /// Colours, and luma in alpha. With blocks an array: see shaders/block.glsl.
    GLuint shaded_texture() const { return shaded_.name(); }
    /// Depths that are the classes of blocks.
    GLuint block_classes() const { return block_classes_.name(); }
    GLuint depth_texture() const { return depth_.name(); }
    /// Colour with premultiplied alpha, to be blended over ground and sky.
    GLuint overlay_texture() const { return overlay_.name(); }
    Image read() const;
    /// Copies the picture into a rectangle of another framebuffer of the context, scaled.
    void copy_to(GLuint framebuffer, int x, int y, int width_px, int height_px) const;

private:
    Framebuffer() = default;
    void bind(const GlFramebuffer& target) const;
    void add_shaded(bool smooths_edges, bool has_blocks);
    int width_px_ = 0, height_px_ = 0, sample_count_ = 0;
    bool is_smoothed_ = false;
    GlTexture depth_, overlay_, shaded_, block_classes_;
    GlRenderbuffer colours_, edges_;
    GlFramebuffer depth_target_, overlay_target_, overlay_alone_, shaded_target_, picture_;
};

/// A buffer rewritten by the CPU every frame while the device may still read the previous ones.
///
/// Uses triple buffering with persistent mapping and fences: begin() waits only while the device still reads the buffer
/// of three frames ago. Measured on a software rasteriser with a million triangles and 150 morphing chunks (16 MB a
/// frame): a frame took 1.03 to 1.05 times the CPU time of a single plain draw, and 1.08 to 1.10 times with one buffer
/// that is reallocated every frame (glNamedBufferData).
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

/// Measures the device time of a frame's commands, by time stamps, without waiting for the result.
///
/// Cycles through three pairs of queries. A frame is not measured if the pair to be reused has no result yet.
class GpuTimer {
public:
    /// Call begin() before and end() after the commands of a frame.
    void begin();
    void end();
    /// Reads the results that have arrived.
    void collect();
    /// Device time of the most recent frame whose result was read, milliseconds; none before the first result.
    std::optional<double> last_ms() const { return last_ms_; }

private:
    struct Turn {
        GlQuery first, last;
        bool is_pending = false;
    };

    std::array<Turn, 3> turns_;
    std::size_t turn_ = 0;
    bool is_active_ = false;
    std::optional<double> last_ms_;
};

}  // namespace terrane::internal
