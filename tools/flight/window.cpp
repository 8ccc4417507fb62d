// SPDX-License-Identifier: MIT
#include "flight/window.h"

// no OpenGL headers
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <utility>

namespace terrane::tools {
namespace {

std::string glfw_trouble() {
    const char* description = nullptr;
    glfwGetError(&description);
    return description != nullptr ? description : "no reason given";
}

}  // namespace

struct Window::State {
    GLFWwindow* window = nullptr;

    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    // destroying the window destroys its context with all objects
    ~State() {
        if (window != nullptr) glfwDestroyWindow(window);
        glfwTerminate();
    }
};

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::Window(Window&&) noexcept = default;
Window& Window::operator=(Window&&) noexcept = default;
Window::~Window() = default;

Result<Window> Window::create(const std::string& title, int width, int height) {
    if (glfwInit() != GLFW_TRUE) {
        return fail(ErrorCode::device_unavailable, "no window can be opened: " + glfw_trouble());
    }
    auto state = std::make_unique<State>();
    // EGL, as off screen, so that both use one driver
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, GLFW_EGL_CONTEXT_API);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    state->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (state->window == nullptr) {
        return fail(ErrorCode::device_unavailable, "no window can be opened: " + glfw_trouble());
    }
    glfwMakeContextCurrent(state->window);
    return Window(std::move(state));
}

Result<void> Window::show(TerrainRenderer& renderer) {
    int width = 0, height = 0;
    glfwGetFramebufferSize(state_->window, &width, &height);
    // a minimised window has no pixels
    if (width > 0 && height > 0) {
        TERRANE_TRY(renderer.present({.width_px = width, .height_px = height}));
        glfwSwapBuffers(state_->window);
    }
    glfwPollEvents();
    if (glfwGetKey(state_->window, GLFW_KEY_ESCAPE) == GLFW_PRESS) {
        glfwSetWindowShouldClose(state_->window, GLFW_TRUE);
    }
    return {};
}

bool Window::is_closed() const { return glfwWindowShouldClose(state_->window) == GLFW_TRUE; }

}  // namespace terrane::tools
