// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>

#include <array>
#include <memory>
#include <set>
#include <string>
#include <vector>

struct GLFWwindow;

namespace terrane::tools {

/// What the user did in a window between two calls of Window::poll(). Keys and buttons have GLFW's numbers; positions
/// are pixels of the framebuffer from its left upper corner.
struct WindowInput {
    /// A key or mouse button that went down.
    struct Press {
        int number = 0;
        int mods = 0;  ///< GLFW_MOD_SHIFT and so on
        double x = 0.0, y = 0.0;
    };
    std::vector<Press> keys, buttons;       ///< in the order of the presses, without repeats
    std::set<int> held_keys, held_buttons;  ///< at the end; keys also if pressed and released
    double x = 0.0, y = 0.0;                ///< of the cursor
    double moved_x = 0.0, moved_y = 0.0;    ///< by the cursor
    double wheel = 0.0;                     ///< notches away from the user
    std::array<double, 2> left_stick = {};  ///< of the first gamepad, -1 to 1: right and up
    std::array<double, 2> triggers = {};    ///< of the first gamepad, 0 to 1: left and right

    bool is_held(int key) const { return held_keys.contains(key); }
};

/// A window with an OpenGL context, in which a renderer draws: see GlContext::adopt_current().
///
/// Threads: the one that created it; one window at a time.
class Window {
public:
    /// Largest side of a window, pixels.
    static constexpr int kMostSide = 16384;

    /// The window's context is then current.
    ///
    /// @param waits_for_display whether show() waits for the display's next refresh
    ///
    /// Fails: device_unavailable, with the reason, if there is no display
    static Result<Window> create(const std::string& title, int width, int height,
                                 bool waits_for_display = true);
    Window(Window&&) noexcept;
    Window& operator=(Window&&) noexcept;
    /// Renderers in the window's context must be gone.
    ~Window();

    /// Copies the renderer's last frame into the window, scaled to it. Fails as TerrainRenderer::present()
    Result<void> draw(TerrainRenderer& renderer);
    /// Shows what was drawn, and processes input events. Fails with device_unavailable if the display is gone.
    Result<void> show();

    /// The user's input since the last call. A press of Escape is reported too.
    WindowInput take_input();

    /// Size of the framebuffer, pixels; 0 while the window is minimised.
    int width_px() const;
    int height_px() const;
    /// Pixels for a length that is a pixel on usual displays.
    double content_scale() const;

    void set_title(const std::string& title);
    void set_clipboard(const std::string& text);
    /// Whether the window covers its monitor.
    bool is_full_screen() const;
    void set_full_screen(bool is_on);

    /// Asks to close the window.
    void close();
    /// Whether the user closed the window.
    bool is_closed() const;

    /// For libraries that draw in the window.
    GLFWwindow* handle() const;

private:
    struct State;
    explicit Window(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
