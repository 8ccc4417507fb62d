// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/image.h>

#include <memory>
#include <string>

namespace terrane::tools {

/// A window that shows finished pictures. It has an OpenGL context of its own, and leaves none
/// current: whoever draws makes theirs current again after create() and show().
///
/// Threads: the one that created it, and one window at a time.
class Window {
public:
    /// Fails with device_unavailable and the reason, where there is no display.
    static Result<Window> create(const std::string& title, int width, int height);
    Window(Window&&) noexcept;
    Window& operator=(Window&&) noexcept;
    ~Window();

    /// Shows a picture, fitted to the window, and takes in what the user did.
    void show(const Image& image);

    /// Whether the user closed it, or pressed Escape.
    bool is_closed() const;

private:
    struct State;
    explicit Window(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
