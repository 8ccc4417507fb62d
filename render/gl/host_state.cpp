// SPDX-License-Identifier: MIT
#include "gl/host_state.h"

#include <cstddef>

namespace terrane::internal {
namespace {

// Capabilities that are off while the renderer draws, except where it enables them itself.
constexpr std::array<GLenum, 29> kFlags = {
    GL_CULL_FACE,           GL_COLOR_LOGIC_OP,      GL_DEPTH_CLAMP,
    GL_DEPTH_TEST,          GL_FRAMEBUFFER_SRGB,    GL_LINE_SMOOTH,
    GL_POLYGON_OFFSET_FILL, GL_POLYGON_OFFSET_LINE, GL_POLYGON_OFFSET_POINT,
    GL_POLYGON_SMOOTH,      GL_PRIMITIVE_RESTART,   GL_PRIMITIVE_RESTART_FIXED_INDEX,
    GL_PROGRAM_POINT_SIZE,  GL_RASTERIZER_DISCARD,  GL_SAMPLE_ALPHA_TO_COVERAGE,
    GL_SAMPLE_ALPHA_TO_ONE, GL_SAMPLE_COVERAGE,     GL_SAMPLE_MASK,
    GL_SAMPLE_SHADING,      GL_SCISSOR_TEST,        GL_STENCIL_TEST,
    GL_CLIP_DISTANCE0,      GL_CLIP_DISTANCE1,      GL_CLIP_DISTANCE2,
    GL_CLIP_DISTANCE3,      GL_CLIP_DISTANCE4,      GL_CLIP_DISTANCE5,
    GL_CLIP_DISTANCE6,      GL_CLIP_DISTANCE7};

struct Store {
    GLenum name;
    GLint initial;
};
constexpr std::array<Store, 12> kStores = {{{GL_PACK_ALIGNMENT, 4},
                                            {GL_PACK_ROW_LENGTH, 0},
                                            {GL_PACK_SKIP_ROWS, 0},
                                            {GL_PACK_SKIP_PIXELS, 0},
                                            {GL_PACK_SWAP_BYTES, 0},
                                            {GL_UNPACK_ALIGNMENT, 4},
                                            {GL_UNPACK_ROW_LENGTH, 0},
                                            {GL_UNPACK_IMAGE_HEIGHT, 0},
                                            {GL_UNPACK_SKIP_ROWS, 0},
                                            {GL_UNPACK_SKIP_PIXELS, 0},
                                            {GL_UNPACK_SKIP_IMAGES, 0},
                                            {GL_UNPACK_SWAP_BYTES, 0}}};

struct Target {
    GLenum target, binding;
};
constexpr std::array<Target, 5> kTextures = {
    {{GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D},
     {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY},
     {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D},
     {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE},
     {GL_TEXTURE_BUFFER, GL_TEXTURE_BINDING_BUFFER}}};
constexpr std::array<Target, 6> kBuffers = {
    {{GL_DRAW_INDIRECT_BUFFER, GL_DRAW_INDIRECT_BUFFER_BINDING},
     {GL_DISPATCH_INDIRECT_BUFFER, GL_DISPATCH_INDIRECT_BUFFER_BINDING},
     {GL_PIXEL_PACK_BUFFER, GL_PIXEL_PACK_BUFFER_BINDING},
     {GL_PIXEL_UNPACK_BUFFER, GL_PIXEL_UNPACK_BUFFER_BINDING},
     {GL_UNIFORM_BUFFER, GL_UNIFORM_BUFFER_BINDING},
     {GL_SHADER_STORAGE_BUFFER, GL_SHADER_STORAGE_BUFFER_BINDING}}};

void set(GLenum flag, bool is_enabled) { is_enabled ? glEnable(flag) : glDisable(flag); }

GLint integer(GLenum name) {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

// OpenGL passes names of objects and enumerators as signed integers when they are read
GLuint name_of(GLint value) { return static_cast<GLuint>(value); }

}  // namespace

HostState::HostState(bool is_needed) : is_needed_(is_needed) {
    if (!is_needed) return;
    while (glGetError() != GL_NO_ERROR) {
    }
    keep();
    for (const GLenum flag : kFlags) glDisable(flag);
    for (const Store& store : kStores) glPixelStorei(store.name, store.initial);
    for (const Target& each : kBuffers) glBindBuffer(each.target, 0);
    for (GLuint unit = 0; unit < kUnits; ++unit) glBindSampler(unit, 0);
    glEnable(GL_MULTISAMPLE);
    glDisable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    glDepthRange(0.0, 1.0);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glCullFace(GL_BACK);
    glFrontFace(GL_CCW);
    glBindVertexArray(0);
    glUseProgram(0);
}

HostState::~HostState() {
    if (is_needed_) restore();
}

void HostState::keep() {
    for (const GLenum flag : kFlags) flags_.push_back(glIsEnabled(flag) == GL_TRUE);
    for (const Store& store : kStores) stores_.push_back(integer(store.name));
    for (const Target& each : kBuffers) buffers_.push_back(integer(each.binding));
    is_multisampled_ = glIsEnabled(GL_MULTISAMPLE) == GL_TRUE;
    unit_ = integer(GL_ACTIVE_TEXTURE);
    for (GLuint unit = 0; unit < kUnits; ++unit) {
        glActiveTexture(GL_TEXTURE0 + unit);
        for (const Target& each : kTextures) textures_.push_back(integer(each.binding));
        samplers_[unit] = integer(GL_SAMPLER_BINDING);
    }
    const auto keep_blocks = [](auto& blocks, GLenum binding, GLenum start, GLenum size) {
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            const auto index = static_cast<GLuint>(i);
            glGetIntegeri_v(binding, index, &blocks[i].name);
            glGetInteger64i_v(start, index, &blocks[i].start);
            glGetInteger64i_v(size, index, &blocks[i].size);
        }
    };
    keep_blocks(uniforms_, GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START,
                GL_UNIFORM_BUFFER_SIZE);
    keep_blocks(storage_, GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START,
                GL_SHADER_STORAGE_BUFFER_SIZE);
    for (GLuint target = 0; target < kTargets; ++target) {
        Blending& blending = blending_[target];
        blending.is_enabled = glIsEnabledi(GL_BLEND, target) == GL_TRUE;
        glGetIntegeri_v(GL_BLEND_SRC_RGB, target, &blending.factors[0]);
        glGetIntegeri_v(GL_BLEND_DST_RGB, target, &blending.factors[1]);
        glGetIntegeri_v(GL_BLEND_SRC_ALPHA, target, &blending.factors[2]);
        glGetIntegeri_v(GL_BLEND_DST_ALPHA, target, &blending.factors[3]);
        glGetIntegeri_v(GL_BLEND_EQUATION_RGB, target, &blending.equations[0]);
        glGetIntegeri_v(GL_BLEND_EQUATION_ALPHA, target, &blending.equations[1]);
        glGetBooleani_v(GL_COLOR_WRITEMASK, target, blending.mask.data());
    }
    program_ = integer(GL_CURRENT_PROGRAM);
    vertices_ = integer(GL_VERTEX_ARRAY_BINDING);
    draw_framebuffer_ = integer(GL_DRAW_FRAMEBUFFER_BINDING);
    read_framebuffer_ = integer(GL_READ_FRAMEBUFFER_BINDING);
    glGetIntegerv(GL_VIEWPORT, viewport_.data());
    depth_function_ = integer(GL_DEPTH_FUNC);
    cull_face_ = integer(GL_CULL_FACE_MODE);
    front_face_ = integer(GL_FRONT_FACE);
    origin_ = integer(GL_CLIP_ORIGIN);
    depth_mode_ = integer(GL_CLIP_DEPTH_MODE);
    glGetIntegerv(GL_POLYGON_MODE, polygon_mode_.data());
    glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
    glGetDoublev(GL_DEPTH_RANGE, depth_range_.data());
    glGetDoublev(GL_DEPTH_CLEAR_VALUE, &clear_depth_);
    glGetFloatv(GL_COLOR_CLEAR_VALUE, clear_colour_.data());
    glGetFloatv(GL_POLYGON_OFFSET_FACTOR, &polygon_offset_[0]);
    glGetFloatv(GL_POLYGON_OFFSET_UNITS, &polygon_offset_[1]);
}

void HostState::restore() const {
    for (std::size_t i = 0; i < kFlags.size(); ++i) set(kFlags[i], flags_[i]);
    set(GL_MULTISAMPLE, is_multisampled_);
    for (std::size_t i = 0; i < kStores.size(); ++i) glPixelStorei(kStores[i].name, stores_[i]);
    for (GLuint unit = 0; unit < kUnits; ++unit) {
        glActiveTexture(GL_TEXTURE0 + unit);
        for (std::size_t i = 0; i < kTextures.size(); ++i)
            glBindTexture(kTextures[i].target, name_of(textures_[unit * kTextures.size() + i]));
        glBindSampler(unit, name_of(samplers_[unit]));
    }
    glActiveTexture(name_of(unit_));
    const auto restore_blocks = [](const auto& blocks, GLenum target) {
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            const auto index = static_cast<GLuint>(i);
            if (blocks[i].size == 0) {
                glBindBufferBase(target, index, name_of(blocks[i].name));
            } else {
                glBindBufferRange(target, index, name_of(blocks[i].name), blocks[i].start,
                                  blocks[i].size);
            }
        }
    };
    restore_blocks(uniforms_, GL_UNIFORM_BUFFER);
    restore_blocks(storage_, GL_SHADER_STORAGE_BUFFER);
    // after the indexed ones, which bind these too
    for (std::size_t i = 0; i < kBuffers.size(); ++i)
        glBindBuffer(kBuffers[i].target, name_of(buffers_[i]));
    for (GLuint target = 0; target < kTargets; ++target) {
        const Blending& blending = blending_[target];
        blending.is_enabled ? glEnablei(GL_BLEND, target) : glDisablei(GL_BLEND, target);
        const auto factor = [&](std::size_t i) { return name_of(blending.factors[i]); };
        glBlendFuncSeparatei(target, factor(0), factor(1), factor(2), factor(3));
        glBlendEquationSeparatei(target, name_of(blending.equations[0]),
                                 name_of(blending.equations[1]));
        glColorMaski(target, blending.mask[0], blending.mask[1], blending.mask[2],
                     blending.mask[3]);
    }
    glUseProgram(name_of(program_));
    glBindVertexArray(name_of(vertices_));
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, name_of(draw_framebuffer_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, name_of(read_framebuffer_));
    glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
    glDepthFunc(name_of(depth_function_));
    glCullFace(name_of(cull_face_));
    glFrontFace(name_of(front_face_));
    glClipControl(name_of(origin_), name_of(depth_mode_));
    glPolygonMode(GL_FRONT_AND_BACK, name_of(polygon_mode_[0]));
    glDepthMask(depth_mask_);
    glDepthRange(depth_range_[0], depth_range_[1]);
    glClearDepth(clear_depth_);
    glClearColor(clear_colour_[0], clear_colour_[1], clear_colour_[2], clear_colour_[3]);
    glPolygonOffset(polygon_offset_[0], polygon_offset_[1]);
}

}  // namespace terrane::internal
