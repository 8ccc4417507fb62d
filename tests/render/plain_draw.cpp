// SPDX-License-Identifier: MIT
#include "render/plain_draw.h"

#include "frame_uniforms.h"
#include "gl_error.h"
#include "ground_noise.h"
#include "shader.h"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::test {
namespace {

using namespace internal;

constexpr std::string_view kPlainVertexShader = R"glsl(
layout(location = 0) in vec4 place;    // xyz: from the eye, w: world z, metres
layout(location = 1) in vec4 surface;  // xy: place in the chunk, zw: in the root square
layout(location = 2) in vec2 map_in;
layout(location = 3) in vec4 edges;
out vec3 p_eye;
out vec2 cell;
out vec2 tile_m;
out float height_m;
flat out vec2 map;
flat out vec4 side_layer;
void main() {
    p_eye = place.xyz;
    cell = surface.xy;
    tile_m = surface.zw;
    height_m = place.w;
    map = map_in;
    side_layer = edges;
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
)glsl";

struct PlainVertex {
    std::array<float, 4> place, surface;
    std::array<float, 2> map;
    std::array<float, 4> edges;
};

double place_in_root(const Lattice& lattice, std::int64_t index) {
    const std::int64_t side = lattice.chunk_side(0);
    return lattice.spacing * static_cast<double>(((index % side) + side) % side);
}

}  // namespace

Result<PlainDraw> PlainDraw::create(const TerrainMesh& mesh, const View& view,
                                    const RendererSettings& settings) {
    Result<Framebuffer> picture =
        Framebuffer::create(view.width_px, view.height_px, settings.sample_count);
    if (!picture) return tl::unexpected(picture.error());
    Result<GlProgram> ground = make_program("the plain terrain", kPlainVertexShader, terrain_frag);
    if (!ground) return tl::unexpected(ground.error());
    Result<GlProgram> sky = make_program("the sky", sky_vert, sky_frag);
    if (!sky) return tl::unexpected(sky.error());
    const Lattice& lattice = mesh.resident->lattice();
    const Result<EyeFrame> eye = make_eye_frame(lattice, view.eye_world);
    if (!eye) return tl::unexpected(eye.error());
    const FrameUniforms uniforms = make_frame_uniforms(settings, lattice, view, *eye);

    PlainDraw made(std::move(*picture));
    made.ground_ = std::move(*ground);
    made.sky_ = std::move(*sky);
    made.noise_ = make_ground_noise();
    made.no_layout_ = make_vertex_array();
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
    picture_.bind();
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(ground_.name());
    glBindVertexArray(layout_.name());
    glBindTextureUnit(0, pool_.page(0).slopes.name());
    glBindTextureUnit(1, noise_.name());
    glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
    glUseProgram(sky_.name());
    glBindVertexArray(no_layout_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    picture_.resolve();
}

Result<void> PlainDraw::upload(const TerrainMesh& mesh, const View& view) {
    const Lattice& lattice = mesh.resident->lattice();
    pool_.follow(*mesh.resident);
    std::vector<PlainVertex> vertices;
    std::vector<std::uint32_t> indices;
    for (std::size_t i = mesh.chunks.size(); i-- > 0;) {
        const MeshChunk& drawn = mesh.chunks[i];
        if (drawn.index_count == 0) continue;
        const Chunk& chunk = *drawn.chunk;
        const ChunkSlot slot = *pool_.find(*mesh.resident, chunk);
        if (slot.page != 0) {
            return fail(ErrorCode::invalid_argument, "the mesh needs more than one page");
        }
        std::array<float, 4> edges{};
        for (std::size_t side = 0; side < 4; ++side) {
            const int level = slot.side_levels[side];
            if (level >= 0) edges[side] = static_cast<float>(chunk.key.level - level);
        }
        const double spacing = lattice.level_spacing(chunk.key.level);
        constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
        std::vector<std::uint32_t> vertex_of(kSlotSamples, kNone);
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
                vertices.push_back(
                    {{place.x(), place.y(), place.z(), static_cast<float>(z)},
                     {static_cast<float>(column), static_cast<float>(row),
                      static_cast<float>(place_in_root(lattice, chunk.corner.x) + spacing * column),
                      static_cast<float>(place_in_root(lattice, chunk.corner.y) + spacing * row)},
                     {static_cast<float>(slot.slot), static_cast<float>(spacing)},
                     edges});
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
    const std::array<GLint, 4> sizes{4, 4, 2, 4};
    GLuint offset = 0;
    for (GLuint attribute = 0; attribute < sizes.size(); ++attribute) {
        glEnableVertexArrayAttrib(layout_.name(), attribute);
        glVertexArrayAttribFormat(layout_.name(), attribute, sizes[attribute], GL_FLOAT, GL_FALSE,
                                  offset);
        glVertexArrayAttribBinding(layout_.name(), attribute, 0);
        offset += static_cast<GLuint>(sizes[attribute] * int{sizeof(float)});
    }
    glVertexArrayVertexBuffer(layout_.name(), 0, vertices_.name(), 0, sizeof(PlainVertex));
    glVertexArrayElementBuffer(layout_.name(), indices_.name());
    return {};
}

}  // namespace terrane::test
