// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>

#include <memory>
#include <string>

namespace terrane::tools {

/// A window with an OpenGL context, in which a renderer draws: see GlContext::adopt_current().
///
/// Threads: the one that created it; one window at a time.
class Window {
public:
    /// The window's context is then current. Fails with device_unavailable and the reason if there is no display.
    static Result<Window> create(const std::string& title, int width, int height);
    Window(Window&&) noexcept;
    Window& operator=(Window&&) noexcept;
    /// Renderers in the window's context must be gone.
    ~Window();

    /// Shows the renderer's last frame, scaled to the window, and processes input events.
    Result<void> show(TerrainRenderer& renderer);

    /// Whether the user closed the window or pressed Escape.
    bool is_closed() const;

private:
    struct State;
    explicit Window(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
