// SPDX-License-Identifier: MIT
//
// Time to draw a mesh, against the same triangles as one plain draw.
//
//   draw_benchmark [--smoke] [--rounds N] [--size WxH] [--samples N] [--morph] [BUDGET ...]
//
// (a) TerrainRenderer::draw(): indices and whatever else changes sent to the device, one command
//     for all chunks, the light.
// (b) glDrawElements, once: the same triangles in the same order, 32-bit indices into one buffer
//     of finished vertices, both on the device already. The same target (size, samples, formats),
//     state and uniforms, the same pass that shades ground and sky, whose light was prepared before;
//     its vertex shader only multiplies by the matrix. So the ratio judges all that (a) does beside
//     rasterising and shading.
//
// With --morph every chunk has offsets, made up here: the most that (a) can have to send.
//
// Both are timed by the wall clock from one glFinish() to the next, in turns; the medians are
// compared. Where the device is no software rasteriser its own timer is read as well: a software rasteriser's
// timer stops before the work is done. Both pictures are compared first, so that a mistake in (b)
// cannot pass for speed.
#include "benchmark/scene/device.h"
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "light/ground_shade.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace terrane::test {

/// Reference for the renderer: the triangles of a mesh as one plain draw call, with 32-bit indices into one buffer of
/// precomputed vertices on the device.
///
/// Target, state, uniforms, shading pass and order of triangles are those of the renderer. The vertex shader only
/// multiplies by the matrix.
class PlainDraw {
public:
    /// Fails with invalid_argument for an eye too far away, device_unavailable for errors of OpenGL.
    static Result<PlainDraw> create(const TerrainMesh& mesh, const View& view,
                                    const RendererSettings& settings);
    void draw() const;
    Image read() const { return picture_.read(); }
    std::size_t vertex_count() const { return vertex_count_; }

private:
    PlainDraw(internal::Framebuffer picture, internal::GroundShade shade)
        : picture_(std::move(picture)), shade_(std::move(shade)) {}
    Result<void> upload(const TerrainMesh& mesh, const View& view);

    internal::Framebuffer picture_;
    internal::GroundShade shade_;
    internal::GlProgram ground_;
    internal::GlBuffer uniforms_, vertices_, indices_;
    internal::GlVertexArray layout_;
    GLsizei index_count_ = 0;
    std::size_t vertex_count_ = 0;
};

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
    TERRANE_TRY(Framebuffer picture,
                Framebuffer::create(view.width_px, view.height_px, settings.sample_count));
    TERRANE_TRY(GlProgram ground,
                make_program("the plain terrain", kPlainVertexShader, depth_frag));
    TERRANE_TRY(GroundShade shade, GroundShade::create(picture.sample_count()));
    const Lattice& lattice = mesh.resident->lattice();
    TERRANE_TRY(const EyeFrame eye, make_eye_frame(lattice, view.eye_world));
    const FrameUniforms uniforms = make_frame_uniforms(settings, lattice, view, eye);

    PlainDraw made(std::move(picture), std::move(shade));
    made.ground_ = std::move(ground);
    TERRANE_TRY(made.shade_.prepare(mesh.resident, view, eye));
    made.uniforms_ = make_buffer();
    glNamedBufferStorage(made.uniforms_.name(), sizeof(uniforms), &uniforms, 0);
    TERRANE_TRY(made.upload(mesh, view));
    TERRANE_TRY(check_gl("set up the plain draw"));
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

namespace terrane::bench {
namespace {

struct Options {
    int rounds = 101;
    int width_px = 1280, height_px = 720;
    int sample_count = 4;
    bool morph = false;
};

// Wall clock of one drawing, milliseconds.
double time_ms(const std::function<void()>& draw) {
    glFinish();
    const Stopwatch watch(Clock::wall);
    draw();
    glFinish();
    return watch.ms();
}

// The device's own clock of one drawing, milliseconds.
double device_ms(const std::function<void()>& draw) {
    GLuint query = 0;
    glGenQueries(1, &query);
    glBeginQuery(GL_TIME_ELAPSED, query);
    draw();
    glEndQuery(GL_TIME_ELAPSED);
    GLuint64 nanoseconds = 0;
    glGetQueryObjectui64v(query, GL_QUERY_RESULT, &nanoseconds);
    glDeleteQueries(1, &query);
    return 1e-6 * static_cast<double>(nanoseconds);
}

// Pixels that differ by more than 8 of 255 in a channel.
int count_different(const Image& a, const Image& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        bool is_different = false;
        for (std::size_t c = i; c < i + 3; ++c) {
            is_different = is_different || std::abs(int{a.rgb[c]} - int{b.rgb[c]}) > 8;
        }
        count += is_different ? 1 : 0;
    }
    return count;
}

struct Comparison {
    double renderer_ms = 0.0, plain_ms = 0.0;
};
Comparison compare(int rounds, const std::function<double(const std::function<void()>&)>& time,
                   const std::function<void()>& renderer, const std::function<void()>& plain) {
    std::vector<double> renderer_ms, plain_ms;
    for (int round = 0; round < rounds; ++round) {
        // each first in every other round: neither always profits from what the other left
        if (round % 2 == 0) renderer_ms.push_back(time(renderer));
        plain_ms.push_back(time(plain));
        if (round % 2 == 1) renderer_ms.push_back(time(renderer));
    }
    return {median(std::move(renderer_ms)), median(std::move(plain_ms))};
}

// False where the two pictures are not of the same thing.
bool run(GlContext& context, const Options& options, std::size_t budget) {
    const std::shared_ptr<const HeightSource> source =
        value_or_exit(FractalHeights::create({.seed = 7, .finest_spacing_log2 = -1}));
    Pager pager = value_or_exit(
        Pager::create(source, {.memory_bytes = std::size_t{1} << 30, .worker_count = 0}));
    TriangulatorSettings wanted;
    wanted.triangle_budget = budget;
    wanted.max_error_px = 0.25;
    Triangulator triangulator = value_or_exit(Triangulator::create(*source, wanted));
    WorldPos eye(321.5, -1234.25, 0.0);
    eye.z() = source->height(eye.x(), eye.y()) + 120.0;
    const View view =
        value_or_exit(look_at(eye, eye + WorldPos(700.0, 700.0, -180.0), 1.0471975511965976,
                              options.width_px, options.height_px));
    TerrainMesh mesh;
    double threshold_px = wanted.max_error_px;
    // the pager fetches for the threshold of the last mesh
    for (int i = 0; i < 6; ++i) {
        const CameraNeed need{.view = view, .threshold_px = threshold_px};
        pager.update({&need, 1}, {}, 0.1 * i);
        pager.finish();
        mesh = triangulator.update(pager.resident(), view);
        threshold_px = mesh.threshold_px;
    }
    std::vector<MeshChunk> morphing(mesh.chunks.begin(), mesh.chunks.end());
    std::vector<std::vector<float>> offsets;
    for (MeshChunk& chunk : morphing) {
        if (!options.morph) break;
        offsets.emplace_back(std::size_t{kChunkSamples} * kChunkSamples);
        for (std::size_t i = 0; i < offsets.back().size(); ++i) {
            offsets.back()[i] = 0.01f * static_cast<float>(i % 16);
        }
        chunk.offsets = offsets.back().data();
    }
    mesh.chunks = morphing;
    RendererSettings settings;
    settings.tint_low = -800.0;
    settings.tint_high = 1200.0;
    settings.sample_count = options.sample_count;
    TerrainRenderer renderer = value_or_exit(
        TerrainRenderer::create(context, options.width_px, options.height_px, settings));
    const test::PlainDraw plain = value_or_exit(test::PlainDraw::create(mesh, view, settings));

    const auto draw_renderer = [&] { value_or_exit(renderer.draw(mesh, view)); };
    const auto draw_plain = [&] { plain.draw(); };
    draw_renderer();
    draw_plain();
    const int different = count_different(renderer.read(), plain.read());
    std::size_t chunk_count = 0, morphing_count = 0;
    for (const MeshChunk& chunk : mesh.chunks) {
        chunk_count += chunk.index_count > 0 ? 1 : 0;
        morphing_count += chunk.offsets != nullptr ? 1 : 0;
    }
    std::printf("%9zu %9zu %7zu %9zu %10d", mesh.triangle_count, plain.vertex_count(), chunk_count,
                morphing_count, different);
    const Comparison wall = compare(options.rounds, time_ms, draw_renderer, draw_plain);
    std::printf(" %9.3f %9.3f %7.3f", wall.renderer_ms, wall.plain_ms,
                wall.renderer_ms / wall.plain_ms);
    if (!context.is_software()) {
        const Comparison device = compare(options.rounds, device_ms, draw_renderer, draw_plain);
        std::printf(" %9.3f %9.3f %7.3f", device.renderer_ms, device.plain_ms,
                    device.renderer_ms / device.plain_ms);
    }
    std::printf("\n");
    std::fflush(stdout);
    return different <= options.width_px * options.height_px / 1000;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane;
    using namespace terrane::bench;
    Arguments arguments(argc, argv,
                        "draw_benchmark [--smoke] [--rounds N] [--size WxH] [--samples N] "
                        "[--morph] [BUDGET ...]");
    const bool is_smoke = arguments.has("--smoke");
    Options options{.morph = arguments.has("--morph")};
    if (is_smoke) options.rounds = 3;
    options.rounds = arguments.number("--rounds", 1.0, 1e6, options.rounds);
    options.sample_count = arguments.number("--samples", 1.0, 64.0, options.sample_count);
    const std::string size = arguments.text("--size", "");
    if (!size.empty() &&
        std::sscanf(size.c_str(), "%dx%d", &options.width_px, &options.height_px) != 2) {
        arguments.exit_with_usage("--size must be WxH, got '" + size + "'");
    }
    std::vector<double> budgets = arguments.numbers("BUDGET", 1.0, 1e8);
    if (budgets.empty()) budgets = is_smoke ? std::vector{1e4} : std::vector{1e4, 1e5, 1e6};
    GlContext context = open_device();
    std::printf("%s, %d x %d, %d samples, median of %d; ms: (a) renderer, (b) one plain draw\n",
                context.renderer_name().c_str(), options.width_px, options.height_px,
                options.sample_count, options.rounds);
    std::printf(
        "triangles  vertices  chunks  morphing  differing   wall (a)  wall (b)   ratio"
        "  device (a), (b), ratio\n");
    bool is_good = true;
    for (const double budget : budgets) {
        is_good = run(context, options, static_cast<std::size_t>(budget)) && is_good;
    }
    if (!is_good) std::fprintf(stderr, "draw_benchmark: the two pictures differ\n");
    return is_good ? 0 : 1;
}
