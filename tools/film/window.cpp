// SPDX-License-Identifier: MIT
#include "film/window.h"

// epoxy before GLFW, which would bring GL headers of its own
#include <epoxy/gl.h>
//
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
    GLuint texture = 0;
    GLuint framebuffer = 0;

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
    // EGL like the renderer's context, so that both use one driver
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, GLFW_EGL_CONTEXT_API);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    state->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (state->window == nullptr) {
        return fail(ErrorCode::device_unavailable, "no window can be opened: " + glfw_trouble());
    }
    glfwMakeContextCurrent(state->window);
    glCreateTextures(GL_TEXTURE_2D, 1, &state->texture);
    glTextureStorage2D(state->texture, 1, GL_RGB8, width, height);
    glCreateFramebuffers(1, &state->framebuffer);
    glNamedFramebufferTexture(state->framebuffer, GL_COLOR_ATTACHMENT0, state->texture, 0);
    // otherwise destroying the window would make the renderer's context not current
    glfwMakeContextCurrent(nullptr);
    return Window(std::move(state));
}

void Window::show(const Image& image) {
    glfwMakeContextCurrent(state_->window);
    int width = 0, height = 0;
    glfwGetFramebufferSize(state_->window, &width, &height);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(state_->texture, 0, 0, 0, image.width, image.height, GL_RGB,
                        GL_UNSIGNED_BYTE, image.rgb.data());
    // row 0 is the top of a picture and the bottom in OpenGL
    glBlitNamedFramebuffer(state_->framebuffer, 0, 0, 0, image.width, image.height, 0, height,
                           width, 0, GL_COLOR_BUFFER_BIT, GL_LINEAR);
    glfwSwapBuffers(state_->window);
    glfwPollEvents();
    if (glfwGetKey(state_->window, GLFW_KEY_ESCAPE) == GLFW_PRESS) {
        glfwSetWindowShouldClose(state_->window, GLFW_TRUE);
    }
    glfwMakeContextCurrent(nullptr);
}

bool Window::is_closed() const { return glfwWindowShouldClose(state_->window) == GLFW_TRUE; }

}  // namespace terrane::tools
