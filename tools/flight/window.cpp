// SPDX-License-Identifier: MIT
#include "flight/window.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

std::string glfw_trouble() {
    const char* description = nullptr;
    glfwGetError(&description);
    return description != nullptr ? description : "no reason given";
}

// Place of a point of the window on its framebuffer.
std::array<double, 2> on_framebuffer(GLFWwindow* window, double x, double y) {
    int width = 0, height = 0, width_px = 0, height_px = 0;
    glfwGetWindowSize(window, &width, &height);
    glfwGetFramebufferSize(window, &width_px, &height_px);
    return {x * width_px / std::max(width, 1), y * height_px / std::max(height, 1)};
}

void read_gamepad(WindowInput& input) {
    constexpr float kDead = 0.15f;  // of a stick at rest
    GLFWgamepadstate pad;
    if (glfwGetGamepadState(GLFW_JOYSTICK_1, &pad) != GLFW_TRUE) return;
    const auto axis = [&pad](int number) {
        const float value = pad.axes[number];
        return std::abs(value) < kDead ? 0.0 : static_cast<double>(value);
    };
    input.left_stick = {axis(GLFW_GAMEPAD_AXIS_LEFT_X), -axis(GLFW_GAMEPAD_AXIS_LEFT_Y)};
    const auto trigger = [&pad](int number) {
        return 0.5 * (static_cast<double>(pad.axes[number]) + 1.0);
    };
    input.triggers = {trigger(GLFW_GAMEPAD_AXIS_LEFT_TRIGGER),
                      trigger(GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER)};
}

}  // namespace

struct Window::State {
    GLFWwindow* window = nullptr;
    WindowInput so_far;                       // since the last take_input()
    std::array<int, 4> before_full_screen{};  // x, y, width, height

    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    // destroying the window destroys its context with all objects
    ~State() {
        if (window != nullptr) glfwDestroyWindow(window);
        glfwTerminate();
    }

    static State& of(GLFWwindow* window) {
        return *static_cast<State*>(glfwGetWindowUserPointer(window));
    }
    void listen();
};

void Window::State::listen() {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
        WindowInput& input = of(w).so_far;
        if (key == GLFW_KEY_UNKNOWN || action == GLFW_REPEAT) return;
        if (action == GLFW_PRESS) {
            input.keys.push_back({key, mods, input.x, input.y});
            input.held_keys.insert(key);
        } else {
            input.held_keys.erase(key);
        }
    });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int mods) {
        WindowInput& input = of(w).so_far;
        if (action == GLFW_PRESS) {
            input.buttons.push_back({button, mods, input.x, input.y});
            input.held_buttons.insert(button);
        } else {
            input.held_buttons.erase(button);
        }
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
        WindowInput& input = of(w).so_far;
        const auto [to_x, to_y] = on_framebuffer(w, x, y);
        input.moved_x += to_x - input.x;
        input.moved_y += to_y - input.y;
        input.x = to_x;
        input.y = to_y;
    });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double y) { of(w).so_far.wheel += y; });
    // a key that is released in another window would stay held
    glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int has_focus) {
        if (has_focus == GLFW_TRUE) return;
        of(w).so_far.held_keys.clear();
        of(w).so_far.held_buttons.clear();
    });
}

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::Window(Window&&) noexcept = default;
Window& Window::operator=(Window&&) noexcept = default;
Window::~Window() = default;

Result<Window> Window::create(const std::string& title, int width, int height,
                              bool waits_for_display) {
    if (width < 1 || height < 1 || width > kMostSide || height > kMostSide) {
        return fail(ErrorCode::invalid_argument,
                    "the sides of a window must be 1 to " + std::to_string(kMostSide) +
                        " pixels, got " + std::to_string(width) + " x " + std::to_string(height));
    }
    if (glfwInit() != GLFW_TRUE) {
        return fail(ErrorCode::device_unavailable, "no window can be opened: " + glfw_trouble());
    }
    auto state = std::make_unique<State>();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    // GLX on X11: a software rasteriser then shares its pictures with the server, where EGL sends them through a
    // socket. EGL for servers without GLX.
    for (const int api : {GLFW_NATIVE_CONTEXT_API, GLFW_EGL_CONTEXT_API}) {
        glfwWindowHint(GLFW_CONTEXT_CREATION_API, api);
        state->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
        if (state->window != nullptr) break;
    }
    if (state->window == nullptr) {
        return fail(ErrorCode::device_unavailable, "no window can be opened: " + glfw_trouble());
    }
    glfwGetError(nullptr);  // that of GLX, if EGL took its place
    state->listen();
    glfwMakeContextCurrent(state->window);
    glfwSwapInterval(waits_for_display ? 1 : 0);
    return Window(std::move(state));
}

Result<void> Window::draw(TerrainRenderer& renderer) {
    // a minimised window has no pixels
    if (width_px() < 1 || height_px() < 1) return {};
    return renderer.present({.width_px = width_px(), .height_px = height_px()});
}

Result<void> Window::show() {
    if (width_px() > 0 && height_px() > 0) glfwSwapBuffers(state_->window);
    glfwPollEvents();
    const char* description = nullptr;
    if (glfwGetError(&description) == GLFW_PLATFORM_ERROR) {
        return fail(ErrorCode::device_unavailable,
                    std::string("the display is gone: ") + description);
    }
    return {};
}

WindowInput Window::take_input() {
    WindowInput& input = state_->so_far;
    WindowInput taken = input;
    // a key that was released since was held for a moment
    for (const WindowInput::Press& key : taken.keys) taken.held_keys.insert(key.number);
    read_gamepad(taken);
    input.keys.clear();
    input.buttons.clear();
    input.moved_x = input.moved_y = input.wheel = 0.0;
    return taken;
}

int Window::width_px() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(state_->window, &width, &height);
    return width;
}

int Window::height_px() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(state_->window, &width, &height);
    return height;
}

double Window::content_scale() const {
    float x = 1.0f, y = 1.0f;
    glfwGetWindowContentScale(state_->window, &x, &y);
    return std::max(1.0, static_cast<double>(std::max(x, y)));
}

void Window::set_title(const std::string& title) {
    glfwSetWindowTitle(state_->window, title.c_str());
}

void Window::set_clipboard(const std::string& text) {
    glfwSetClipboardString(state_->window, text.c_str());
}

bool Window::is_full_screen() const { return glfwGetWindowMonitor(state_->window) != nullptr; }

void Window::set_full_screen(bool is_on) {
    if (is_on == is_full_screen()) return;
    auto& [x, y, width, height] = state_->before_full_screen;
    GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
    const GLFWvidmode* const mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
    if (is_on && mode != nullptr) {
        glfwGetWindowPos(state_->window, &x, &y);
        glfwGetWindowSize(state_->window, &width, &height);
        glfwSetWindowMonitor(state_->window, monitor, 0, 0, mode->width, mode->height,
                             mode->refreshRate);
    } else if (!is_on) {
        glfwSetWindowMonitor(state_->window, nullptr, x, y, width, height, GLFW_DONT_CARE);
    }
}

void Window::close() { glfwSetWindowShouldClose(state_->window, GLFW_TRUE); }

bool Window::is_closed() const { return glfwWindowShouldClose(state_->window) == GLFW_TRUE; }

GLFWwindow* Window::handle() const { return state_->window; }

}  // namespace terrane::tools
