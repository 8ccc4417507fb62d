// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <epoxy/gl.h>

#include <string>
#include <utility>

namespace terrane::internal {

/// Owns an OpenGL object by its name; the name 0 stands for no object. Kind::destroy() deletes an object. The context
/// must be current when the destructor runs.
template <class Kind>
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
        if (name_ != 0) Kind::destroy(name_);
    }
    GLuint name() const { return name_; }

private:
    GLuint name_ = 0;
};

// Template arguments are types instead of functions: with -fvisibility-inlines-hidden, GCC treats a type whose template
// argument is an inline function as hidden, and warns about classes with members of that type.
struct BufferKind {
    static void destroy(GLuint name) { glDeleteBuffers(1, &name); }
};
struct TextureKind {
    static void destroy(GLuint name) { glDeleteTextures(1, &name); }
};
struct VertexArrayKind {
    static void destroy(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct FramebufferKind {
    static void destroy(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct RenderbufferKind {
    static void destroy(GLuint name) { glDeleteRenderbuffers(1, &name); }
};
struct SamplerKind {
    static void destroy(GLuint name) { glDeleteSamplers(1, &name); }
};
struct ShaderKind {
    static void destroy(GLuint name) { glDeleteShader(name); }
};
struct ProgramKind {
    static void destroy(GLuint name) { glDeleteProgram(name); }
};

using GlBuffer = GlObject<BufferKind>;
using GlTexture = GlObject<TextureKind>;
using GlVertexArray = GlObject<VertexArrayKind>;
using GlFramebuffer = GlObject<FramebufferKind>;
using GlRenderbuffer = GlObject<RenderbufferKind>;
using GlSampler = GlObject<SamplerKind>;
using GlShader = GlObject<ShaderKind>;
using GlProgram = GlObject<ProgramKind>;

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
inline GlTexture make_texture_3d() {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &name);
    return GlTexture(name);
}
inline GlSampler make_sampler() {
    GLuint name = 0;
    glCreateSamplers(1, &name);
    return GlSampler(name);
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

/// Errors and high-severity messages in the debug output of a context since the last check_gl().
struct GlLog {
    std::string first;  ///< first error or high-severity message; empty: none
    int count = 0;
};

/// Redirects the debug output of the current context to a log, which must outlive the context.
void attach_log(GlLog& log);

/// Fails with device_unavailable if the current context has an error or its log has a message; clears both.
///
/// @param doing the operation, for the message: "draw the terrain"
Result<void> check_gl(const std::string& doing);

}  // namespace terrane::internal
