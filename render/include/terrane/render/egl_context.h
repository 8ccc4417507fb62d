// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <memory>
#include <string>

namespace terrane {

/// Whether a context watches over itself: with `on`, whatever OpenGL's debug output calls an error or
/// of high severity fails the drawing that caused it. For tests; it costs speed on some drivers.
enum class GlChecks { off, on };

/// An off-screen OpenGL 4.5 core context without a window system.
class EglContext {
public:
    /// Tries the surfaceless platform, then every device. Current on the calling thread when it
    /// returns.
    ///
    /// Fails with device_unavailable and the EGL errors where none opens. A machine without a GPU
    /// normally succeeds, with a software rasteriser.
    static Result<EglContext> create(GlChecks checks = GlChecks::off);

    EglContext(EglContext&&) noexcept;
    EglContext& operator=(EglContext&&) noexcept;
    ~EglContext();

    /// Binds the context to the calling thread.
    void make_current();

    /// GL_RENDERER; golden images are stored per renderer family.
    const std::string& renderer_name() const;

    /// Whoever holds it keeps the context from being destroyed: renderers, for their last breath.
    std::shared_ptr<const void> keep_alive() const;

private:
    struct State;
    explicit EglContext(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;
};

}  // namespace terrane
