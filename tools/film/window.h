// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/image.h>

#include <memory>
#include <string>

namespace terrane::tools {

/// A window that shows finished pictures. It has its own OpenGL context and leaves none current: make yours current
/// again after create() and show().
///
/// Threads: the one that created it; one window at a time.
class Window {
public:
    /// Fails with device_unavailable and the reason, where there is no display.
    static Result<Window> create(const std::string& title, int width, int height);
    Window(Window&&) noexcept;
    Window& operator=(Window&&) noexcept;
    ~Window();

    /// Shows a picture scaled to the window, and processes input events.
    void show(const Image& image);

    /// Whether the user closed the window or pressed Escape.
    bool is_closed() const;

private:
    struct State;
    explicit Window(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
