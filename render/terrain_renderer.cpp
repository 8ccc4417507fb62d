// SPDX-License-Identifier: MIT
#include "chunk_cache.h"
#include "eye_frame.h"
#include "frame_uniforms.h"
#include "framebuffer.h"
#include "gl_error.h"
#include "ground_noise.h"
#include "object_mesh.h"
#include "shader.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/assert.h>

#include <cmath>
#include <string>

namespace terrane {
namespace {

using namespace internal;

// Uniforms of one terrain program; the wireframe lacks some, and OpenGL ignores location -1.
struct TerrainProgram {
    GlProgram program;
    GLint corner = -1, stride = -1, tile = -1, side_layer = -1;
};

struct ObjectProgram {
    GlProgram program;
    GLint axes = -1, extents = -1, centre = -1, colour = -1;
};

// What the draw of one chunk needs.
struct ChunkDraw {
    const MeshChunk* mesh = nullptr;
    const DeviceChunk* device = nullptr;
};

Result<void> check(const RendererSettings& settings) {
    const auto refuse = [](const std::string& message) -> Result<void> {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (!settings.sun_direction.allFinite() || !(settings.sun_direction.norm() > 0.0)) {
        return refuse("sun_direction must be finite and not zero");
    }
    if (!(settings.haze_distance > 0.0)) {
        return refuse("haze_distance must be > 0 m, got " + std::to_string(settings.haze_distance));
    }
    if (!std::isfinite(settings.tint_low) || !std::isfinite(settings.tint_high) ||
        !(settings.tint_high > settings.tint_low)) {
        return refuse("tint_high must be above tint_low, got " +
                      std::to_string(settings.tint_high) + " and " +
                      std::to_string(settings.tint_low));
    }
    if (settings.sample_count < 1 || settings.sample_count > 16) {
        return refuse("sample_count must be 1 to 16, got " + std::to_string(settings.sample_count));
    }
    return {};
}

// Everything that could be wrong with a frame, before anything of it is drawn.
Result<void> check(const TerrainMesh& mesh, const View& view, const Framebuffer& picture) {
    if (const Result<void> good = terrane::check(view); !good) return good;
    if (view.width_px != picture.width_px() || view.height_px != picture.height_px()) {
        return fail(ErrorCode::invalid_argument,
                    "the view is for " + std::to_string(view.width_px) + " x " +
                        std::to_string(view.height_px) + " pixels, the renderer for " +
                        std::to_string(picture.width_px()) + " x " +
                        std::to_string(picture.height_px()));
    }
    if (mesh.resident == nullptr && !mesh.chunks.empty()) {
        return fail(ErrorCode::invalid_argument, "the mesh has chunks, but no resident set");
    }
    for (const MeshChunk& chunk : mesh.chunks) {
        if (std::size_t{chunk.first_index} + chunk.index_count > mesh.indices.size()) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh has " + std::to_string(mesh.indices.size()) +
                            " indices, a chunk's end at " +
                            std::to_string(std::size_t{chunk.first_index} + chunk.index_count));
        }
    }
    return {};
}

Result<TerrainProgram> make_terrain_program(const std::string& name, std::string_view fragment) {
    Result<GlProgram> made = make_program(name, terrain_vert, fragment);
    if (!made) return tl::unexpected(made.error());
    TerrainProgram terrain;
    terrain.corner = glGetUniformLocation(made->name(), "corner");
    terrain.stride = glGetUniformLocation(made->name(), "stride");
    terrain.tile = glGetUniformLocation(made->name(), "tile");
    terrain.side_layer = glGetUniformLocation(made->name(), "side_layer");
    terrain.program = std::move(*made);
    return terrain;
}

Result<ObjectProgram> make_object_program() {
    Result<GlProgram> made = make_program("objects", object_vert, object_frag);
    if (!made) return tl::unexpected(made.error());
    ObjectProgram object;
    object.axes = glGetUniformLocation(made->name(), "axes");
    object.extents = glGetUniformLocation(made->name(), "extents");
    object.centre = glGetUniformLocation(made->name(), "centre");
    object.colour = glGetUniformLocation(made->name(), "colour");
    object.program = std::move(*made);
    return object;
}

// Place in a root square, metres; the noise repeats with it.
float tile_place(const Lattice& lattice, std::int64_t index) {
    const std::int64_t side = lattice.chunk_side(0);
    return static_cast<float>(lattice.spacing *
                              static_cast<double>(((index % side) + side) % side));
}

void set_chunk(const TerrainProgram& terrain, const Lattice& lattice, const EyeFrame& eye,
               const ChunkDraw& draw) {
    const Chunk& chunk = *draw.mesh->chunk;
    const SplitInteger x = split(chunk.corner.x - eye.x, kIndexBits);
    const SplitInteger y = split(chunk.corner.y - eye.y, kIndexBits);
    const SplitInteger stride = split(chunk.step, kIndexBits);
    glUniform4i(terrain.corner, x.high, x.low, y.high, y.low);
    glUniform2i(terrain.stride, stride.high, stride.low);
    glUniform3f(terrain.tile, tile_place(lattice, chunk.corner.x),
                tile_place(lattice, chunk.corner.y),
                static_cast<float>(lattice.spacing * static_cast<double>(chunk.step)));
    // coarser ground beside a chunk has no finer light than its own level
    FrameUniforms::Vec4 layers{};
    for (std::size_t side = 0; side < layers.size(); ++side) {
        const int level = draw.device->side_levels[side];
        if (level >= 0) layers[side] = static_cast<float>(chunk.key.level - level);
    }
    glUniform4fv(terrain.side_layer, 1, layers.data());
}

}  // namespace

struct TerrainRenderer::State {
    std::shared_ptr<const void> context;  // first: it must outlive all names below
    RendererSettings settings;
    Framebuffer picture;
    TerrainProgram ground, wires;
    ObjectProgram objects;
    GlProgram sky;
    GlVertexArray ground_layout, object_layout, no_layout;
    GlBuffer frame_uniforms, indices;
    GlTexture noise;
    ObjectMesh cube, ball;
    ChunkCache chunks;
    std::weak_ptr<const ResidentSet> followed;
    std::vector<ChunkDraw> draws;

    explicit State(Framebuffer made) : picture(std::move(made)) {}

    Result<void> make_programs();
    void make_buffers();
    Result<void> collect(const TerrainMesh& mesh);
    void draw_ground(const TerrainMesh& mesh, const EyeFrame& eye);
    void draw_chunks(const TerrainProgram& program, const Lattice& lattice, const EyeFrame& eye);
    void draw_objects(const View& view, std::span<const DrawnBox> boxes,
                      std::span<const DrawnSphere> spheres);
    void draw_sky();
};

Result<void> TerrainRenderer::State::make_programs() {
    Result<TerrainProgram> made_ground = make_terrain_program("the terrain", terrain_frag);
    if (!made_ground) return tl::unexpected(made_ground.error());
    Result<TerrainProgram> made_wires = make_terrain_program("the wireframe", line_frag);
    if (!made_wires) return tl::unexpected(made_wires.error());
    Result<ObjectProgram> made_objects = make_object_program();
    if (!made_objects) return tl::unexpected(made_objects.error());
    Result<GlProgram> made_sky = make_program("the sky", sky_vert, sky_frag);
    if (!made_sky) return tl::unexpected(made_sky.error());
    ground = std::move(*made_ground);
    wires = std::move(*made_wires);
    objects = std::move(*made_objects);
    sky = std::move(*made_sky);
    return {};
}

void TerrainRenderer::State::make_buffers() {
    frame_uniforms = make_buffer();
    glNamedBufferStorage(frame_uniforms.name(), sizeof(FrameUniforms), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    indices = make_buffer();
    noise = make_ground_noise();
    cube = make_cube();
    ball = make_ball();

    no_layout = make_vertex_array();
    ground_layout = make_vertex_array();
    glEnableVertexArrayAttrib(ground_layout.name(), 0);
    glVertexArrayAttribIFormat(ground_layout.name(), 0, 1, GL_INT, 0);
    glVertexArrayAttribBinding(ground_layout.name(), 0, 0);
    object_layout = make_vertex_array();
    for (GLuint attribute = 0; attribute < 2; ++attribute) {
        glEnableVertexArrayAttrib(object_layout.name(), attribute);
        glVertexArrayAttribFormat(object_layout.name(), attribute, 3, GL_FLOAT, GL_FALSE,
                                  attribute * 3 * sizeof(float));
        glVertexArrayAttribBinding(object_layout.name(), attribute, 0);
    }
}

// Brings every chunk of the mesh to the device, nearest first.
Result<void> TerrainRenderer::State::collect(const TerrainMesh& mesh) {
    draws.clear();
    if (mesh.resident == nullptr) return {};
    if (followed.lock() != mesh.resident) {
        chunks.follow(*mesh.resident);
        followed = mesh.resident;
    }
    // the mesh goes from coarse to fine; near ground drawn first hides what lies behind it
    for (std::size_t i = mesh.chunks.size(); i-- > 0;) {
        const MeshChunk& chunk = mesh.chunks[i];
        if (chunk.index_count == 0) continue;
        const DeviceChunk* device = chunks.find(*mesh.resident, *chunk.chunk);
        if (device == nullptr) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh draws a chunk that is not in its resident set");
        }
        draws.push_back({&chunk, device});
    }
    return {};
}

void TerrainRenderer::State::draw_chunks(const TerrainProgram& program, const Lattice& lattice,
                                         const EyeFrame& eye) {
    glUseProgram(program.program.name());
    for (const ChunkDraw& draw : draws) {
        set_chunk(program, lattice, eye, draw);
        glBindTextureUnit(0, draw.device->slopes.name());
        glVertexArrayVertexBuffer(ground_layout.name(), 0, draw.device->heights.name(), 0,
                                  sizeof(std::int32_t));
        const std::size_t first_byte = sizeof(std::uint16_t) * draw.mesh->first_index;
        // GL takes an offset into the index buffer spelled as a pointer
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(draw.mesh->index_count),
                       GL_UNSIGNED_SHORT, reinterpret_cast<const void*>(first_byte));
    }
}

void TerrainRenderer::State::draw_ground(const TerrainMesh& mesh, const EyeFrame& eye) {
    if (draws.empty()) return;
    glNamedBufferData(indices.name(), static_cast<GLsizeiptr>(mesh.indices.size_bytes()),
                      mesh.indices.data(), GL_STREAM_DRAW);
    glBindVertexArray(ground_layout.name());
    glVertexArrayElementBuffer(ground_layout.name(), indices.name());
    glBindTextureUnit(1, noise.name());
    draw_chunks(ground, mesh.resident->lattice(), eye);
    if (!settings.wireframe) return;
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glEnable(GL_POLYGON_OFFSET_LINE);
    glPolygonOffset(1.0f, 4.0f);  // depth is reversed: more is nearer
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    draw_chunks(wires, mesh.resident->lattice(), eye);
    glDisable(GL_BLEND);
    glDisable(GL_POLYGON_OFFSET_LINE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

void TerrainRenderer::State::draw_objects(const View& view, std::span<const DrawnBox> boxes,
                                          std::span<const DrawnSphere> spheres) {
    if (boxes.empty() && spheres.empty()) return;
    glUseProgram(objects.program.name());
    glBindVertexArray(object_layout.name());
    const auto draw = [&](const ObjectMesh& mesh, const Pose& world_from_object,
                          const Eigen::Vector3d& extents, float red, float green, float blue) {
        const Eigen::Matrix3f axes = world_from_object.rotation.cast<float>();
        const Eigen::Vector3f size = extents.cast<float>();
        const LocalVec centre = to_local(world_from_object.translation, view.eye_world);
        glUniformMatrix3fv(objects.axes, 1, GL_FALSE, axes.data());
        glUniform3f(objects.extents, size.x(), size.y(), size.z());
        glUniform3f(objects.centre, centre.x(), centre.y(), centre.z());
        glUniform3f(objects.colour, red, green, blue);
        glDrawElements(GL_TRIANGLES, mesh.index_count, GL_UNSIGNED_SHORT, nullptr);
    };
    const auto bind = [&](const ObjectMesh& mesh) {
        glVertexArrayVertexBuffer(object_layout.name(), 0, mesh.vertices.name(), 0,
                                  6 * sizeof(float));
        glVertexArrayElementBuffer(object_layout.name(), mesh.indices.name());
    };
    bind(cube);
    for (const DrawnBox& box : boxes) {
        draw(cube, box.world_from_box, box.half_extents, box.red, box.green, box.blue);
    }
    bind(ball);
    for (const DrawnSphere& sphere : spheres) {
        Pose pose;
        pose.translation = sphere.centre_world;
        draw(ball, pose, Eigen::Vector3d::Constant(sphere.radius), sphere.red, sphere.green,
             sphere.blue);
    }
}

void TerrainRenderer::State::draw_sky() {
    glUseProgram(sky.name());
    glBindVertexArray(no_layout.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

TerrainRenderer::TerrainRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
TerrainRenderer::TerrainRenderer(TerrainRenderer&&) noexcept = default;
TerrainRenderer& TerrainRenderer::operator=(TerrainRenderer&&) noexcept = default;
TerrainRenderer::~TerrainRenderer() = default;

Result<TerrainRenderer> TerrainRenderer::create(EglContext& context, int width_px, int height_px,
                                                const RendererSettings& settings) {
    if (const Result<void> good = check(settings); !good) return tl::unexpected(good.error());
    Result<Framebuffer> picture = Framebuffer::create(width_px, height_px, settings.sample_count);
    if (!picture) return tl::unexpected(picture.error());
    auto state = std::make_unique<State>(std::move(*picture));
    state->context = context.keep_alive();
    state->settings = settings;
    if (const Result<void> made = state->make_programs(); !made) {
        return tl::unexpected(made.error());
    }
    state->make_buffers();
    if (const Result<void> good = check_gl("set up the renderer"); !good) {
        return tl::unexpected(good.error());
    }
    return TerrainRenderer(std::move(state));
}

Result<void> TerrainRenderer::draw(const TerrainMesh& mesh, const View& view,
                                   std::span<const DrawnBox> boxes,
                                   std::span<const DrawnSphere> spheres) {
    State& state = *state_;
    if (const Result<void> good = check(mesh, view, state.picture); !good) return good;
    // without a world any lattice will do for the sky
    const Lattice lattice = mesh.resident == nullptr ? Lattice{} : mesh.resident->lattice();
    EyeFrame eye;
    if (mesh.resident != nullptr) {
        const Result<EyeFrame> made = make_eye_frame(lattice, view.eye_world);
        if (!made) return tl::unexpected(made.error());
        eye = *made;
    }
    if (const Result<void> collected = state.collect(mesh); !collected) return collected;

    const FrameUniforms uniforms = make_frame_uniforms(state.settings, lattice, view, eye);
    glNamedBufferSubData(state.frame_uniforms.name(), 0, sizeof(uniforms), &uniforms);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, state.frame_uniforms.name());

    state.picture.bind();
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    state.draw_ground(mesh, eye);
    state.draw_objects(view, boxes, spheres);
    // last, where nothing else is: it lies at depth 0
    state.draw_sky();
    if (const Result<void> good = check_gl("draw the terrain"); !good) return good;
    state.picture.resolve();
    return check_gl("resolve the picture");
}

Image TerrainRenderer::read() const { return state_->picture.read(); }

std::size_t TerrainRenderer::buffer_bytes() const { return state_->chunks.bytes(); }

}  // namespace terrane
