// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace terrane {

/// Whether OpenGL's debug output is checked. With `on`, a call that causes an error or a high-severity message fails.
/// For tests; drawing is slower on some drivers.
enum class GlChecks { off, on };

/// An OpenGL 4.5 context: one of our own, off screen and without a window system, or a host's.
class GlContext {
public:
    /// Opens a context on the surfaceless platform or, if that fails, on the first device on which it succeeds. The
    /// context is then current on the calling thread. A machine without a GPU normally has a software rasteriser.
    ///
    /// Fails with device_unavailable if no context can be opened; the message lists the EGL errors.
    static Result<GlContext> create(GlChecks checks = GlChecks::off);
    /// Uses the context that is current on the calling thread. The host has made it (by EGL, GLX, GLFW, Qt), and keeps
    /// it until all renderers in it are gone. Calls of a renderer leave the state of a host's context as they find it.
    /// No transform feedback, conditional rendering or query may be active during a call, and errors that the host has
    /// not read are lost.
    ///
    /// Fails with device_unavailable if no context is current, or it is not OpenGL 4.5 or later.
    static Result<GlContext> adopt_current();

    GlContext(GlContext&&) noexcept;
    GlContext& operator=(GlContext&&) noexcept;
    ~GlContext();

    /// Binds the context to the calling thread; no effect for a host's.
    void make_current();
    /// Whether it is a host's context.
    bool is_adopted() const;

    /// GL_RENDERER of the driver.
    const std::string& renderer_name() const;
    /// Whether the driver renders on the CPU, recognised by the names of known software rasterisers.
    bool is_software() const;

    /// Shares ownership of the context. Renderers keep the pointer, so that the context outlives their OpenGL objects.
    std::shared_ptr<const void> keep_alive() const;

private:
    struct State;
    explicit GlContext(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;
};

/// 8-bit RGB, row-major from the top.
struct Image {
    int width = 0;                  ///< pixels
    int height = 0;                 ///< pixels
    std::vector<std::uint8_t> rgb;  ///< [height * width * 3]
};

/// Writes a PNG file: first PATH.part, which is then renamed, so that an incomplete picture never appears under PATH.
/// Fails: invalid_argument if the bytes do not match the size; io, naming the path, if the file cannot be written.
Result<void> write_png(const Image& image, const std::string& path);
/// Reads a PNG file, with transparent pixels over black. Fails with io; the message names the path.
Result<Image> read_png(const std::string& path);

}  // namespace terrane
