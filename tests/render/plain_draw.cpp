// SPDX-License-Identifier: MIT
#include "plain_draw.h"

#include "gl/gl_object.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::test {
namespace {

using namespace internal;

constexpr std::string_view kPlainVertexShader = R"glsl(
layout(location = 0) in vec3 place;  // relative to the eye, metres
void main() {
    gl_Position = frame.clip_from_eye * vec4(place, 1.0);
}
)glsl";

using PlainVertex = std::array<float, 3>;

}  // namespace

Result<PlainDraw> PlainDraw::create(const TerrainMesh& mesh, const View& view,
                                    const RendererSettings& settings) {
    Result<Framebuffer> picture =
        Framebuffer::create(view.width_px, view.height_px, settings.sample_count);
    if (!picture) return tl::unexpected(picture.error());
    Result<GlProgram> ground = make_program("the plain terrain", kPlainVertexShader, depth_frag);
    if (!ground) return tl::unexpected(ground.error());
    Result<GroundShade> shade = GroundShade::create(picture->sample_count());
    if (!shade) return tl::unexpected(shade.error());
    const Lattice& lattice = mesh.resident->lattice();
    const Result<EyeFrame> eye = make_eye_frame(lattice, view.eye_world);
    if (!eye) return tl::unexpected(eye.error());
    const FrameUniforms uniforms = make_frame_uniforms(settings, lattice, view, *eye);

    PlainDraw made(std::move(*picture), std::move(*shade));
    made.ground_ = std::move(*ground);
    if (const Result<void> lit = made.shade_.prepare(mesh.resident, view, *eye); !lit) {
        return tl::unexpected(lit.error());
    }
    made.uniforms_ = make_buffer();
    glNamedBufferStorage(made.uniforms_.name(), sizeof(uniforms), &uniforms, 0);
    if (const Result<void> good = made.upload(mesh, view); !good) {
        return tl::unexpected(good.error());
    }
    if (const Result<void> good = check_gl("set up the plain draw"); !good) {
        return tl::unexpected(good.error());
    }
    return made;
}

void PlainDraw::draw() const {
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_.name());
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    picture_.bind_depth();
    glClear(GL_DEPTH_BUFFER_BIT);
    glUseProgram(ground_.name());
    glBindVertexArray(layout_.name());
    glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
    shade_.draw(picture_, false);
}

Result<void> PlainDraw::upload(const TerrainMesh& mesh, const View& view) {
    const Lattice& lattice = mesh.resident->lattice();
    std::vector<PlainVertex> vertices;
    std::vector<std::uint32_t> indices;
    for (std::size_t i = mesh.chunks.size(); i-- > 0;) {
        const MeshChunk& drawn = mesh.chunks[i];
        if (drawn.index_count == 0) continue;
        const Chunk& chunk = *drawn.chunk;
        constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
        std::vector<std::uint32_t> vertex_of(std::size_t{kChunkSamples} * kChunkSamples, kNone);
        for (const std::uint16_t sample :
             mesh.indices.subspan(drawn.first_index, drawn.index_count)) {
            std::uint32_t& vertex = vertex_of[sample];
            if (vertex == kNone) {
                vertex = static_cast<std::uint32_t>(vertices.size());
                const int column = sample % kChunkSamples, row = sample / kChunkSamples;
                const double z = drawn.displayed_height(sample, lattice.quantum);
                const LocalVec place = to_local({lattice.x(chunk.corner.x + column * chunk.step),
                                                 lattice.y(chunk.corner.y + row * chunk.step), z},
                                                view.eye_world);
                vertices.push_back({place.x(), place.y(), place.z()});
            }
            indices.push_back(vertex);
        }
    }
    vertex_count_ = vertices.size();
    index_count_ = static_cast<GLsizei>(indices.size());
    vertices_ = make_buffer();
    glNamedBufferStorage(vertices_.name(),
                         static_cast<GLsizeiptr>(vertices.size() * sizeof(PlainVertex)),
                         vertices.data(), 0);
    indices_ = make_buffer();
    glNamedBufferStorage(indices_.name(),
                         static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
                         indices.data(), 0);
    layout_ = make_vertex_array();
    glEnableVertexArrayAttrib(layout_.name(), 0);
    glVertexArrayAttribFormat(layout_.name(), 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(layout_.name(), 0, 0);
    glVertexArrayVertexBuffer(layout_.name(), 0, vertices_.name(), 0, sizeof(PlainVertex));
    glVertexArrayElementBuffer(layout_.name(), indices_.name());
    return {};
}

}  // namespace terrane::test
