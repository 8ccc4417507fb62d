// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace terrane {

/// Whether OpenGL's debug output is checked: with `on`, the drawing that causes an error or a high-severity message
/// fails. For tests; slower on some drivers.
enum class GlChecks { off, on };

/// An off-screen OpenGL 4.5 core context without a window system.
class EglContext {
public:
    /// Tries the surfaceless platform, then every device. The context is current on the calling thread on return.
    ///
    /// Fails with device_unavailable and the EGL errors if none can be opened. A machine without a GPU normally
    /// succeeds with a software rasteriser.
    static Result<EglContext> create(GlChecks checks = GlChecks::off);

    EglContext(EglContext&&) noexcept;
    EglContext& operator=(EglContext&&) noexcept;
    ~EglContext();

    /// Binds the context to the calling thread.
    void make_current();

    /// GL_RENDERER of the driver.
    const std::string& renderer_name() const;
    /// Whether the driver renders on the CPU, recognised by the names of known software rasterisers.
    bool is_software() const;

    /// Shares ownership of the context: renderers hold it, so that the context outlives their OpenGL objects.
    std::shared_ptr<const void> keep_alive() const;

private:
    struct State;
    explicit EglContext(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;
};

/// 8-bit RGB, row-major from the top.
struct Image {
    int width = 0;                  ///< pixels
    int height = 0;                 ///< pixels
    std::vector<std::uint8_t> rgb;  ///< [height * width * 3]
};

/// Writes PATH.part and renames it, so that an incomplete picture never appears under PATH. Fails with io, naming the
/// path.
Result<void> write_png(const Image& image, const std::string& path);
/// Reads a PNG file. Fails with io, naming the path.
Result<Image> read_png(const std::string& path);

}  // namespace terrane
