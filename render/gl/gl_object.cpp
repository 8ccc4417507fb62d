// SPDX-License-Identifier: MIT
#include "gl/gl_object.h"

#include <epoxy/gl.h>

namespace terrane::internal {
namespace {

void on_message(GLenum /*source*/, GLenum type, GLuint /*id*/, GLenum severity, GLsizei length,
                const GLchar* message, const void* user) {
    if (type != GL_DEBUG_TYPE_ERROR && severity != GL_DEBUG_SEVERITY_HIGH) return;
    // `user` is the pointer from attach_log(); the callback type adds const
    auto* log = static_cast<GlLog*>(const_cast<void*>(user));
    if (log->count == 0) {
        log->first = length < 0 ? std::string(message)
                                : std::string(message, static_cast<std::size_t>(length));
        while (!log->first.empty() && log->first.back() == '\n') log->first.pop_back();
    }
    ++log->count;
}

std::string error_name(GLenum error) {
    switch (error) {
        case GL_INVALID_ENUM:
            return "GL_INVALID_ENUM";
        case GL_INVALID_VALUE:
            return "GL_INVALID_VALUE";
        case GL_INVALID_OPERATION:
            return "GL_INVALID_OPERATION";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "GL_INVALID_FRAMEBUFFER_OPERATION";
        case GL_OUT_OF_MEMORY:
            return "GL_OUT_OF_MEMORY";
        case GL_CONTEXT_LOST:
            return "GL_CONTEXT_LOST";
        default:
            return "GL error " + std::to_string(error);
    }
}

}  // namespace

void attach_log(GlLog& log) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(&on_message, &log);
}

Result<void> check_gl(const std::string& doing) {
    std::string trouble;
    // bounded, because a lost context reports its error forever
    for (int i = 0; i < 16; ++i) {
        const GLenum error = glGetError();
        if (error == GL_NO_ERROR) break;
        if (trouble.empty()) trouble = error_name(error);
    }
    void* user = nullptr;
    glGetPointerv(GL_DEBUG_CALLBACK_USER_PARAM, &user);
    if (auto* log = static_cast<GlLog*>(user); log != nullptr && log->count > 0) {
        trouble += (trouble.empty() ? "" : ": ") + log->first;
        *log = {};
    }
    if (trouble.empty()) return {};
    return fail(ErrorCode::device_unavailable, "OpenGL cannot " + doing + ": " + trouble);
}

}  // namespace terrane::internal
