// SPDX-License-Identifier: MIT
#include "gl/shader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <initializer_list>
#include <vector>

namespace terrane::internal {
namespace {

using GetParameter = void (*)(GLuint, GLenum, GLint*);
using GetLog = void (*)(GLuint, GLsizei, GLsizei*, GLchar*);

std::string first_lines(GLuint object, GetParameter get, GetLog get_log) {
    GLint length = 0;
    get(object, GL_INFO_LOG_LENGTH, &length);
    std::vector<char> text(static_cast<std::size_t>(length) + 1, '\0');
    get_log(object, length, nullptr, text.data());
    std::string log(text.data());
    while (!log.empty() && log.back() == '\n') log.pop_back();
    return log;
}

Result<GlShader> compile(const std::string& name, GLenum stage, std::string_view head,
                         std::string_view body) {
    GlShader shader(glCreateShader(stage));
    const std::array<const GLchar*, 2> texts{head.data(), body.data()};
    const std::array<GLint, 2> lengths{static_cast<GLint>(head.size()),
                                       static_cast<GLint>(body.size())};
    glShaderSource(shader.name(), 2, texts.data(), lengths.data());
    glCompileShader(shader.name());
    GLint is_good = 0;
    glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &is_good);
    if (is_good == GL_FALSE) {
        return fail(
            ErrorCode::device_unavailable,
            "the device refused the shader of " + name + ": " +
                first_lines(
                    shader.name(), [](GLuint o, GLenum p, GLint* v) { glGetShaderiv(o, p, v); },
                    [](GLuint o, GLsizei n, GLsizei* l, GLchar* t) {
                        glGetShaderInfoLog(o, n, l, t);
                    }));
    }
    return shader;
}

}  // namespace

std::string light_text(const LightFeatures& features) {
    std::string text;
    if (features.cascades > 0)
        text += "#define CASCADES " + std::to_string(features.cascades) + "\n";
    if (features.has_penumbra) text += "#define PENUMBRA\n";
    if (features.has_atmosphere) text += "#define ATMOSPHERE\n";
    if (features.has_water) text += "#define WATER\n";
    text += std::string(features.has_atmosphere ? atmosphere_glsl : haze_glsl);
    if (features.point_lights > 0) {
        text += "#define POINT_LIGHTS " + std::to_string(features.point_lights) + "\n" +
                std::string(point_light_glsl);
    }
    if (features.has_water && features.has_waves) text += "#define WAVES\n";
    text += std::string(shadow_glsl) + std::string(water_glsl);
    if (features.has_imagery) text += "#define IMAGERY\n" + std::string(imagery_glsl);
    if (features.anisotropy > 0) {
        text += "#define MATERIALS\n#define ANISOTROPY " + std::to_string(features.anisotropy) +
                "\n" + std::string(ground_material_glsl);
    }
    return text;
}

namespace {

Result<GlProgram> link(const std::string& name, std::initializer_list<GLuint> shaders) {
    GlProgram program(glCreateProgram());
    for (const GLuint shader : shaders) glAttachShader(program.name(), shader);
    glLinkProgram(program.name());
    GLint is_good = 0;
    glGetProgramiv(program.name(), GL_LINK_STATUS, &is_good);
    if (is_good == GL_FALSE) {
        return fail(
            ErrorCode::device_unavailable,
            "the device refused to link " + name + ": " +
                first_lines(
                    program.name(), [](GLuint o, GLenum p, GLint* v) { glGetProgramiv(o, p, v); },
                    [](GLuint o, GLsizei n, GLsizei* l, GLchar* t) {
                        glGetProgramInfoLog(o, n, l, t);
                    }));
    }
    return program;
}

}  // namespace

Result<GlProgram> make_program(const std::string& name, std::string_view vertex,
                               std::string_view fragment) {
    TERRANE_TRY(GlShader vertex_shader, compile(name, GL_VERTEX_SHADER, light_glsl, vertex));
    TERRANE_TRY(GlShader fragment_shader, compile(name, GL_FRAGMENT_SHADER, light_glsl, fragment));
    return link(name, {vertex_shader.name(), fragment_shader.name()});
}

Result<GlProgram> make_compute_program(const std::string& name, std::string_view text) {
    TERRANE_TRY(GlShader shader, compile(name, GL_COMPUTE_SHADER, "", text));
    return link(name, {shader.name()});
}

namespace {

// The same function as in light.glsl.
std::uint32_t hash_of(const SquareTable::Entry& entry) {
    const std::uint32_t hash = static_cast<std::uint32_t>(entry.x) * 0x9e3779b1u ^
                               static_cast<std::uint32_t>(entry.y) * 0x85ebca77u ^
                               static_cast<std::uint32_t>(entry.level) * 0xc2b2ae3du;
    return hash ^ (hash >> 15);
}

std::int32_t saturate(std::int64_t value) {
    constexpr std::int64_t kMost = std::int64_t{1} << 30;
    return static_cast<std::int32_t>(std::clamp(value, -kMost, kMost));
}

}  // namespace

SquareTable::SquareTable(std::size_t count) : entries_(std::bit_ceil(2 * count + 1)) {}

void SquareTable::add(std::int64_t x, std::int64_t y, int level, std::int32_t value) {
    const Entry entry{saturate(x), saturate(y), level, value};
    const std::size_t last = entries_.size() - 1;
    std::size_t place = hash_of(entry) & last;
    while (entries_[place].level >= 0) place = (place + 1) & last;
    entries_[place] = entry;
}

}  // namespace terrane::internal
