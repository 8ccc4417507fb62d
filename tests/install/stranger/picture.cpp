// SPDX-License-Identifier: MIT
// Draws a picture of ground; not all of it may be sky.
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <cstdio>
#include <string>

namespace {

constexpr int kNoDevice = 77;  // exit code for a skipped test

int fail(const terrane::Error& error) {
    std::printf("%s\n", error.message.c_str());
    return 1;
}

}  // namespace

int main() {
    using namespace terrane;
    Result<GlContext> context = GlContext::create();
    if (!context) {
        fail(context.error());
        return kNoDevice;
    }
    Result<TerrainRenderer> renderer = TerrainRenderer::create(*context, 160, 90, {});
    if (!renderer) return fail(renderer.error());

    const auto source = FractalHeights::create({.seed = 7});
    if (!source) return fail(source.error());
    Result<Pager> pager = Pager::create(*source, {.worker_count = 0});
    if (!pager) return fail(pager.error());
    Result<Triangulator> triangulator = Triangulator::create(**source, {.triangle_budget = 2000});
    if (!triangulator) return fail(triangulator.error());
    const Result<View> view = look_at({0, 0, 3000}, {0, 5000, 0}, 1.0, 160, 90);
    if (!view) return fail(view.error());

    const auto draw = [&]() -> Result<Image> {
        const TerrainMesh mesh = triangulator->update(pager->resident(), *view);
        if (const auto drawn = renderer->draw(mesh, *view); !drawn) {
            return tl::unexpected(drawn.error());
        }
        return renderer->read();
    };
    const Result<Image> sky = draw();  // nothing is resident yet
    if (!sky) return fail(sky.error());
    const CameraNeed camera{.view = *view, .threshold_px = 16.0};
    pager->update({&camera, 1}, {}, 0.0);
    const Result<Image> ground = draw();
    if (!ground) return fail(ground.error());

    std::printf("drawn by %s\n", context->renderer_name().c_str());
    return ground->rgb != sky->rgb ? 0 : 1;
}
