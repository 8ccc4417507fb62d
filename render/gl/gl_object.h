// SPDX-License-Identifier: MIT
#pragma once

#include <epoxy/gl.h>

#include <utility>

namespace terrane::internal {

/// Owns one OpenGL name; 0 owns nothing. The context must be current in the destructor.
template <void (*Delete)(GLuint)>
class GlObject {
public:
    GlObject() = default;
    explicit GlObject(GLuint name) : name_(name) {}
    GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    GlObject& operator=(GlObject&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    ~GlObject() {
        if (name_ != 0) Delete(name_);
    }
    GLuint name() const { return name_; }

private:
    GLuint name_ = 0;
};

inline void delete_buffer(GLuint name) { glDeleteBuffers(1, &name); }
inline void delete_texture(GLuint name) { glDeleteTextures(1, &name); }
inline void delete_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
inline void delete_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
inline void delete_renderbuffer(GLuint name) { glDeleteRenderbuffers(1, &name); }
inline void delete_shader(GLuint name) { glDeleteShader(name); }
inline void delete_program(GLuint name) { glDeleteProgram(name); }

using GlBuffer = GlObject<&delete_buffer>;
using GlTexture = GlObject<&delete_texture>;
using GlVertexArray = GlObject<&delete_vertex_array>;
using GlFramebuffer = GlObject<&delete_framebuffer>;
using GlRenderbuffer = GlObject<&delete_renderbuffer>;
using GlShader = GlObject<&delete_shader>;
using GlProgram = GlObject<&delete_program>;

inline GlBuffer make_buffer() {
    GLuint name = 0;
    glCreateBuffers(1, &name);
    return GlBuffer(name);
}
inline GlTexture make_texture_2d() {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    return GlTexture(name);
}
inline GlTexture make_texture_2d_samples() {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &name);
    return GlTexture(name);
}
inline GlTexture make_texture_buffer() {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
    return GlTexture(name);
}
inline GlTexture make_texture_2d_array() {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
    return GlTexture(name);
}
inline GlVertexArray make_vertex_array() {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    return GlVertexArray(name);
}
inline GlFramebuffer make_framebuffer() {
    GLuint name = 0;
    glCreateFramebuffers(1, &name);
    return GlFramebuffer(name);
}
inline GlRenderbuffer make_renderbuffer() {
    GLuint name = 0;
    glCreateRenderbuffers(1, &name);
    return GlRenderbuffer(name);
}

}  // namespace terrane::internal
