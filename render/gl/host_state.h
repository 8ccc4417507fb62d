// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <array>
#include <vector>

namespace terrane::internal {

/// The state of a host's context while the renderer uses it: the constructor keeps it and sets OpenGL's initial state,
/// the destructor restores it. Kept is all state that the renderer changes or depends on; framebuffers, vertex arrays
/// and objects of the host are not touched. Errors that the host has not read are lost: they would seem ours.
///
/// Cost: about 400 calls that read or set state, 8 microseconds with Mesa's llvmpipe
class HostState {
public:
    /// @param is_needed false: does nothing, for contexts of our own
    explicit HostState(bool is_needed);
    ~HostState();
    HostState(const HostState&) = delete;
    HostState& operator=(const HostState&) = delete;

private:
    /// Units and binding points that the renderer uses.
    static constexpr GLuint kUnits = 19, kUniformBlocks = 7, kStorageBlocks = 8, kTargets = 8;

    struct IndexedBuffer {
        GLint name = 0;
        GLint64 start = 0, size = 0;
    };
    struct Blending {
        bool is_enabled = false;
        std::array<GLint, 4> factors{};  // source and destination, of colours and of alpha
        std::array<GLint, 2> equations{};
        std::array<GLboolean, 4> mask{};
    };

    void keep();
    void restore() const;

    bool is_needed_, is_multisampled_ = true;
    std::vector<bool> flags_;      // in the order of kFlags in host_state.cpp
    std::vector<GLint> stores_;    // of pixels, likewise
    std::vector<GLint> textures_;  // [kUnits * targets of textures], likewise
    std::array<GLint, kUnits> samplers_{};
    std::array<IndexedBuffer, kUniformBlocks> uniforms_{};
    std::array<IndexedBuffer, kStorageBlocks> storage_{};
    std::array<Blending, kTargets> blending_{};
    std::vector<GLint> buffers_;  // bound to targets without an index
    GLint program_ = 0, vertices_ = 0, unit_ = 0, draw_framebuffer_ = 0, read_framebuffer_ = 0;
    std::array<GLint, 4> viewport_{};
    GLint depth_function_ = 0, cull_face_ = 0, front_face_ = 0, origin_ = 0, depth_mode_ = 0;
    std::array<GLint, 2> polygon_mode_{};
    GLboolean depth_mask_ = GL_TRUE;
    std::array<GLdouble, 2> depth_range_{};
    GLdouble clear_depth_ = 1.0;
    std::array<GLfloat, 4> clear_colour_{};
    std::array<GLfloat, 2> polygon_offset_{};
};

}  // namespace terrane::internal
