// SPDX-License-Identifier: MIT
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "render/render_scene.h"

#include <terrane/render/offscreen.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/primitive_meshes.h>

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace terrane {
namespace host_context_test {

using internal::GlBuffer;
using internal::GlFramebuffer;
using internal::GlProgram;
using internal::GlSampler;
using internal::GlTexture;
using internal::GlVertexArray;

constexpr int kWidth = 160, kHeight = 120;

constexpr const char* kHostVertex = R"(
void main() {
    vec2 at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(1.6 * at - 0.7, 0.5, 1.0);
})";
constexpr const char* kHostFragment = R"(
layout(std140, binding = 1) uniform Tint { vec4 tint; };
layout(binding = 3) uniform sampler2D picture;
layout(location = 0) out vec4 colour;
void main() { colour = 0.5 * tint + texelFetch(picture, ivec2(gl_FragCoord.xy) & 1, 0); })";

// A program that draws a triangle with unusual state.
class Host {
public:
    Host() {
        // the layers, the tint at a byte that is not 0, and four texels
        constexpr std::array<float, 128> kTint = [] {
            std::array<float, 128> bytes{};
            bytes[64] = 0.2f, bytes[65] = 0.9f, bytes[66] = 0.4f, bytes[67] = 0.3f;
            return bytes;
        }();
        glNamedBufferStorage(tint_.name(), sizeof(kTint), kTint.data(), 0);
        constexpr std::array<std::uint8_t, 16> kTexels = {10,  20, 200, 90, 60, 5,  70,  255,
                                                          130, 40, 0,   30, 90, 99, 180, 120};
        glTextureStorage2D(texture_.name(), 1, GL_RGBA8, 2, 2);
        glTextureSubImage2D(texture_.name(), 0, 0, 0, 2, 2, GL_RGBA, GL_UNSIGNED_BYTE,
                            kTexels.data());
        glTextureStorage2D(colours_.name(), 1, GL_RGBA8, kWidth, kHeight);
        glNamedFramebufferTexture(target_.name(), GL_COLOR_ATTACHMENT0, colours_.name(), 0);
        glNamedBufferStorage(pixels_.name(), 4096, nullptr, 0);
        set_state();
    }

    // All values that OpenGL gives of the state that a renderer may change.
    static std::vector<double> state() {
        std::vector<double> values;
        const auto add = [&](GLenum name, std::size_t count) {
            std::array<GLdouble, 4> read{};
            glGetDoublev(name, read.data());
            values.insert(values.end(), read.begin(),
                          read.begin() + static_cast<std::ptrdiff_t>(count));
        };
        for (const GLenum one : std::initializer_list<GLenum>{GL_ACTIVE_TEXTURE,
                                                              GL_ARRAY_BUFFER_BINDING,
                                                              GL_BLEND,
                                                              GL_BLEND_DST_ALPHA,
                                                              GL_BLEND_DST_RGB,
                                                              GL_BLEND_EQUATION_ALPHA,
                                                              GL_BLEND_EQUATION_RGB,
                                                              GL_BLEND_SRC_ALPHA,
                                                              GL_BLEND_SRC_RGB,
                                                              GL_CLIP_DEPTH_MODE,
                                                              GL_CLIP_ORIGIN,
                                                              GL_COLOR_LOGIC_OP,
                                                              GL_CULL_FACE,
                                                              GL_CULL_FACE_MODE,
                                                              GL_CURRENT_PROGRAM,
                                                              GL_DEPTH_CLAMP,
                                                              GL_DEPTH_CLEAR_VALUE,
                                                              GL_DEPTH_FUNC,
                                                              GL_DEPTH_TEST,
                                                              GL_DEPTH_WRITEMASK,
                                                              GL_DITHER,
                                                              GL_DRAW_FRAMEBUFFER_BINDING,
                                                              GL_DRAW_INDIRECT_BUFFER_BINDING,
                                                              GL_FRAMEBUFFER_SRGB,
                                                              GL_FRONT_FACE,
                                                              GL_LINE_WIDTH,
                                                              GL_MULTISAMPLE,
                                                              GL_PACK_ALIGNMENT,
                                                              GL_PACK_ROW_LENGTH,
                                                              GL_PIXEL_PACK_BUFFER_BINDING,
                                                              GL_PIXEL_UNPACK_BUFFER_BINDING,
                                                              GL_POLYGON_OFFSET_FACTOR,
                                                              GL_POLYGON_OFFSET_FILL,
                                                              GL_POLYGON_OFFSET_LINE,
                                                              GL_POLYGON_OFFSET_UNITS,
                                                              GL_PRIMITIVE_RESTART,
                                                              GL_PROGRAM_PIPELINE_BINDING,
                                                              GL_RASTERIZER_DISCARD,
                                                              GL_READ_FRAMEBUFFER_BINDING,
                                                              GL_SAMPLE_ALPHA_TO_COVERAGE,
                                                              GL_SAMPLE_MASK,
                                                              GL_SCISSOR_TEST,
                                                              GL_SHADER_STORAGE_BUFFER_BINDING,
                                                              GL_STENCIL_TEST,
                                                              GL_UNIFORM_BUFFER_BINDING,
                                                              GL_UNPACK_ALIGNMENT,
                                                              GL_UNPACK_ROW_LENGTH,
                                                              GL_UNPACK_SKIP_PIXELS,
                                                              GL_VERTEX_ARRAY_BINDING}) {
            add(one, 1);
        }
        for (const GLenum two : std::initializer_list<GLenum>{GL_DEPTH_RANGE, GL_POLYGON_MODE})
            add(two, 2);
        for (const GLenum four : std::initializer_list<GLenum>{
                 GL_COLOR_CLEAR_VALUE, GL_COLOR_WRITEMASK, GL_SCISSOR_BOX, GL_VIEWPORT}) {
            add(four, 4);
        }
        const auto add_at = [&](GLenum name, GLuint index) {
            GLint64 read = 0;
            glGetInteger64i_v(name, index, &read);
            values.push_back(static_cast<double>(read));
        };
        for (GLuint index = 0; index < 8; ++index) {
            for (const GLenum name : std::initializer_list<GLenum>{
                     GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE,
                     GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START,
                     GL_SHADER_STORAGE_BUFFER_SIZE}) {
                add_at(name, index);
            }
        }
        GLint unit = 0;
        glGetIntegerv(GL_ACTIVE_TEXTURE, &unit);
        for (GLuint i = 0; i < 32; ++i) {
            glActiveTexture(GL_TEXTURE0 + i);
            for (const GLenum name : std::initializer_list<GLenum>{
                     GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_2D_ARRAY, GL_TEXTURE_BINDING_3D,
                     GL_TEXTURE_BINDING_2D_MULTISAMPLE, GL_TEXTURE_BINDING_BUFFER,
                     GL_TEXTURE_BINDING_CUBE_MAP, GL_SAMPLER_BINDING}) {
                add(name, 1);
            }
        }
        glActiveTexture(static_cast<GLenum>(unit));
        return values;
    }

    GLuint framebuffer() const { return target_.name(); }
    void clear() const { glClear(GL_COLOR_BUFFER_BIT); }
    void draw_triangle() const { glDrawArrays(GL_TRIANGLES, 0, 3); }
    std::vector<std::uint8_t> pixels() const {
        std::vector<std::uint8_t> pixels(std::size_t{4} * kWidth * kHeight);
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
        glGetTextureImage(colours_.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE,
                          static_cast<GLsizei>(pixels.size()), pixels.data());
        glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels_.name());
        return pixels;
    }

private:
    void set_state() const {
        glBindFramebuffer(GL_FRAMEBUFFER, target_.name());
        glUseProgram(program_.name());
        glBindVertexArray(layout_.name());
        glBindBufferRange(GL_UNIFORM_BUFFER, 1, tint_.name(), 256, 256);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, tint_.name());
        glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels_.name());
        for (const GLuint unit : {0u, 3u, 12u, 18u}) glBindTextureUnit(unit, texture_.name());
        for (const GLuint unit : {3u, 6u, 14u}) glBindSampler(unit, sampler_.name());
        glActiveTexture(GL_TEXTURE5);
        for (const GLenum flag : std::initializer_list<GLenum>{
                 GL_BLEND, GL_CULL_FACE, GL_DEPTH_CLAMP, GL_POLYGON_OFFSET_FILL,
                 GL_PRIMITIVE_RESTART, GL_SCISSOR_TEST, GL_STENCIL_TEST}) {
            glEnable(flag);
        }
        glDisable(GL_MULTISAMPLE);
        glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_COLOR);
        glBlendEquation(GL_FUNC_REVERSE_SUBTRACT);
        glBlendEquationSeparatei(0, GL_FUNC_ADD, GL_MAX);
        glCullFace(GL_FRONT);
        glFrontFace(GL_CW);
        glClipControl(GL_UPPER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
        glDepthFunc(GL_NEVER);
        glDepthMask(GL_FALSE);
        glDepthRange(0.2, 0.7);
        glClearDepth(0.3);
        glClearColor(0.1f, 0.3f, 0.2f, 0.6f);
        glColorMask(GL_TRUE, GL_TRUE, GL_FALSE, GL_TRUE);
        glPolygonOffset(3.0f, -7.0f);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 7);
        glPixelStorei(GL_UNPACK_SKIP_PIXELS, 2);
        glPixelStorei(GL_PACK_ALIGNMENT, 8);
        glScissor(5, 9, 120, 77);
        glViewport(3, 2, 150, 100);
    }

    GlProgram program_ = *internal::make_program("the host", kHostVertex, kHostFragment);
    GlVertexArray layout_ = internal::make_vertex_array();
    GlBuffer tint_ = internal::make_buffer(), pixels_ = internal::make_buffer();
    GlTexture texture_ = internal::make_texture_2d(), colours_ = internal::make_texture_2d();
    GlSampler sampler_ = internal::make_sampler();
    GlFramebuffer target_ = internal::make_framebuffer();
};

class HostContextTest : public test::GlTest {
protected:
    // A renderer with everything that binds state.
    static Result<TerrainRenderer> make_renderer(GlContext& context, int sample_count = 1) {
        return TerrainRenderer::create(context, kWidth, kHeight,
                                       {.sample_count = sample_count,
                                        .shadow_distance = 300.0,
                                        .sun_radius = 0.005,
                                        .atmosphere = true,
                                        .smooth_edges = true,
                                        .water_level = -3.0,
                                        .has_waves = true,
                                        .ground_look = GroundLookSettings()});
    }
    const View view_ = *look_at({190.0, 20.0, 60.0}, {200.0, 140.0, 0.0}, 1.0, kWidth, kHeight);
};

TEST_F(HostContextTest, EveryCallLeavesTheStateOfTheHost) {
    const Host host;
    ASSERT_TRUE(internal::check_gl("set up the host"));
    const std::vector<double> before = Host::state();
    const test::Scene scene = test::make_scene();
    const TriangleMesh ball = *make_sphere_mesh(3.0);
    GlContext context = *GlContext::adopt_current();
    EXPECT_TRUE(context.is_adopted());
    context.make_current();
    {
        std::optional<TerrainRenderer> renderer;
        MeshId mesh{};
        ImpostorId impostor{};
        const ObjectInstance instance = test::instance_at(view_, {200.0, 140.0, 5.0});
        const std::pair<const char*, std::function<bool()>> calls[] = {
            {"create",
             [&] {
                 renderer.emplace(*make_renderer(context));
                 return true;
             }},
            {"add_mesh", [&] { return (mesh = *renderer->add_mesh(ball), true); }},
            {"add_impostor", [&] { return (impostor = *renderer->add_impostor(mesh), true); }},
            {"draw",
             [&] {
                 const MeshDraw draw = {.mesh = mesh, .instance_count = 1};
                 const ImpostorDraw far{impostor, 0, 1};
                 return renderer
                     ->draw(scene.mesh(), view_,
                            {.instances = {&instance, 1},
                             .meshes = {&draw, 1},
                             .impostors = {&far, 1}})
                     .has_value();
             }},
            {"read", [&] { return renderer->read().width == kWidth; }},
            {"present",
             [&] {
                 return renderer
                     ->present({.framebuffer = host.framebuffer(), .width_px = 20, .height_px = 20})
                     .has_value();
             }},
            {"remove_impostor", [&] { return (renderer->remove_impostor(impostor), true); }},
            {"remove_mesh", [&] { return (renderer->remove_mesh(mesh), true); }},
            {"the destructor", [&] { return (renderer.reset(), true); }}};
        for (const auto& [name, call] : calls) {
            EXPECT_TRUE(call()) << name;
            EXPECT_EQ(Host::state(), before) << name;
        }
    }
}

TEST_F(HostContextTest, TheHostsPictureAndOursAreThoseOfContextsOfTheirOwn) {
    const test::Scene scene = test::make_scene();
    const auto picture_of = [&](TerrainRenderer renderer) {
        EXPECT_TRUE(renderer.draw(scene.mesh(), view_));
        return renderer.read();
    };
    const Image alone = picture_of(*make_renderer(*context_));
    const Image multisampled = picture_of(*make_renderer(*context_, 4));
    const Host host;
    host.clear();
    host.draw_triangle();
    host.draw_triangle();
    const std::vector<std::uint8_t> wanted = host.pixels();
    EXPECT_GT(std::set<std::uint8_t>(wanted.begin(), wanted.end()).size(), 5u);

    host.clear();
    host.draw_triangle();
    GlContext context = *GlContext::adopt_current();
    TerrainRenderer renderer = *make_renderer(context);
    ASSERT_TRUE(renderer.draw(scene.mesh(), view_));
    EXPECT_EQ(renderer.read().rgb, alone.rgb);
    EXPECT_EQ(picture_of(*make_renderer(context, 4)).rgb, multisampled.rgb);
    // into the upper right of a larger framebuffer
    GlTexture shown = internal::make_texture_2d();
    glTextureStorage2D(shown.name(), 1, GL_RGBA8, 2 * kWidth, 2 * kHeight);
    GlFramebuffer window = internal::make_framebuffer();
    glNamedFramebufferTexture(window.name(), GL_COLOR_ATTACHMENT0, shown.name(), 0);
    constexpr std::array<std::uint8_t, 4> kBlue = {1, 2, 200, 77};
    glClearTexImage(shown.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE, kBlue.data());
    const Result<void> presented =
        renderer.present({window.name(), kWidth - 10, kHeight - 5, kWidth, kHeight});
    ASSERT_TRUE(presented) << presented.error().message;
    host.draw_triangle();
    EXPECT_EQ(host.pixels(), wanted);

    std::vector<std::uint8_t> pixels(std::size_t{16} * kWidth * kHeight);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glGetTextureImage(shown.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE,
                      static_cast<GLsizei>(pixels.size()), pixels.data());
    int wrong = 0;
    for (int y = 0; y < 2 * kHeight; ++y) {
        for (int x = 0; x < 2 * kWidth; ++x) {
            const std::uint8_t* const found =
                &pixels[4 * static_cast<std::size_t>(y * 2 * kWidth + x)];
            const int column = x - (kWidth - 10), row = kHeight - 1 - (y - (kHeight - 5));
            const bool is_inside = column >= 0 && column < kWidth && row >= 0 && row < kHeight;
            const std::uint8_t* const expected =
                is_inside ? test::pixel(alone, column, row) : kBlue.data();
            wrong += std::equal(found, found + 3, expected) ? 0 : 1;
        }
    }
    EXPECT_EQ(wrong, 0);
}

TEST_F(HostContextTest, PresentRefusesWhatItCannotFill) {
    GlContext context = *GlContext::adopt_current();
    TerrainRenderer renderer = *make_renderer(context);
    for (const auto& [width, height] : {std::pair(0, 5), std::pair(5, -1)}) {
        const Result<void> none = renderer.present({.width_px = width, .height_px = height});
        ASSERT_FALSE(none);
        EXPECT_EQ(none.error().code, ErrorCode::invalid_argument);
    }
    const Result<void> absent =
        renderer.present({.framebuffer = 4321, .width_px = 10, .height_px = 10});
    ASSERT_FALSE(absent);
    EXPECT_EQ(absent.error().code, ErrorCode::device_unavailable);
}

TEST(HostContext, NoCurrentContextIsRefused) {
    {
        // made and gone: none is current afterwards
        const Result<GlContext> own = GlContext::create();
        if (!own) GTEST_SKIP() << own.error().message;
    }
    const Result<GlContext> adopted = GlContext::adopt_current();
    ASSERT_FALSE(adopted);
    EXPECT_EQ(adopted.error().code, ErrorCode::device_unavailable);
    EXPECT_EQ(adopted.error().message, "no OpenGL context is current on the calling thread");
}

}  // namespace host_context_test
}  // namespace terrane
