// SPDX-License-Identifier: MIT
//
// A renderer of one's own, examples/gl_uploader.h, draws what TerrainRenderer draws. Both pictures are lit by the same
// pass from depths, so that they differ where depths do.
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "gl_uploader.h"
#include "light/frame_uniforms.h"
#include "light/ground_shade.h"
#include "render/render_scene.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <optional>
#include <utility>

namespace terrane {
namespace own_renderer_test {

using namespace internal;

constexpr int kWidth = 480;
constexpr int kHeight = 270;

constexpr std::string_view kVertexShader = R"glsl(
layout(location = 0) in vec3 position;       // metres from MeshBuffers::origin_world()
layout(location = 0) uniform vec3 eye;       // from there too
void main() {
    gl_Position = frame.clip_from_eye * vec4(position - eye, 1.0);
}
)glsl";

class OwnRenderer : public test::PictureTest<kWidth, kHeight> {
protected:
    // The depths of what the uploader holds, lit as the renderer does.
    std::optional<Image> draw(const GlUploader& uploader, const WorldPos& origin_world,
                              const TerrainMesh& mesh, const View& view,
                              const RendererSettings& settings) {
        Result<Framebuffer> picture = Framebuffer::create(kWidth, kHeight, 1);
        Result<GlProgram> ground = make_program("the own renderer", kVertexShader, depth_frag);
        Result<GroundShade> shade = GroundShade::create(1);
        const Result<EyeFrame> eye = make_eye_frame(mesh.resident->lattice(), view.eye_world);
        if (!picture || !ground || !shade || !eye) return std::nullopt;
        if (!shade->prepare(mesh.resident, view, *eye)) return std::nullopt;
        const FrameUniforms uniforms =
            make_frame_uniforms(settings, mesh.resident->lattice(), view, *eye);
        const GlBuffer buffer = make_buffer();
        glNamedBufferStorage(buffer.name(), sizeof(uniforms), &uniforms, 0);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer.name());
        glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GEQUAL);
        glClearDepth(0.0);
        picture->bind_depth();
        glClear(GL_DEPTH_BUFFER_BIT);
        glUseProgram(ground->name());
        const LocalVec eye_from_origin = to_local(view.eye_world, origin_world);
        glUniform3f(0, eye_from_origin.x(), eye_from_origin.y(), eye_from_origin.z());
        uploader.draw();
        shade->draw(*picture, false);
        EXPECT_TRUE(check_gl("draw with the own renderer"));
        return picture->read();
    }
};

TEST_F(OwnRenderer, DrawsThePictureOfTheRenderer) {
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 30'000}).value();
    MeshBuffers buffers = MeshBuffers::create({.rebase_distance = 500.0}).value();
    GlUploader uploader;
    const RendererSettings settings{.sample_count = 1};
    CameraNeed camera;
    for (int frame = 0; frame < 24; ++frame) {
        const WorldPos eye(2000.3, 60.0 * frame, 900.1);
        camera.view = view_from(eye, eye + Eigen::Vector3d(800.0, 4000.0, -900.0));
        pager.update({&camera, 1}, {}, frame / 10.0);
        const TerrainMesh mesh = triangulator.update(pager.resident(), camera.view);
        camera.threshold_px = mesh.threshold_px;
        buffers.update(mesh, eye);
        uploader.upload(buffers);
        if (frame % 12 != 11) continue;
        TerrainRenderer renderer = make(settings);
        const Image ours = test::draw(renderer, mesh, camera.view);
        const auto own = draw(uploader, buffers.origin_world(), mesh, camera.view, settings);
        ASSERT_TRUE(own.has_value());
        // edges of pixels on the rounding of float
        EXPECT_LT(test::count_different(ours, *own, 6), kWidth * kHeight / 500)
            << "frame " << frame;
        // and the picture is not just sky, and depends on what was uploaded
        const auto nothing =
            draw(GlUploader(), buffers.origin_world(), mesh, camera.view, settings);
        EXPECT_GT(test::count_different(ours, *nothing, 6), kWidth * kHeight / 3);
    }
    uploader.clear();
}

}  // namespace own_renderer_test
}  // namespace terrane
