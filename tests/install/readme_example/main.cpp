// SPDX-License-Identifier: MIT
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <cstdio>

int main() {
    using namespace terrane;  // value() throws where a setting is out of range
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    auto triangulator = Triangulator::create(*source, {.triangle_budget = 200'000}).value();
    // A camera looks north; the ground around (100, 200) is needed at once.
    const View view = look_at({0, 0, 1500}, {0, 9000, 0}, 1.0, 1280, 720).value();
    const CameraNeed camera{.view = view, .threshold_px = 4.0};
    pager.require({.west = 90, .south = 190, .east = 110, .north = 210}, 0.0);
    pager.update({&camera, 1}, {}, 0.0);  // once a frame; does not block
    pager.finish();                       // blocks until all of it is loaded

    const TerrainMesh mesh = triangulator.update(pager.resident(), view);
    std::printf("%zu triangles, off by %.2f px at most\n", mesh.triangle_count, mesh.error_px);
    const Ground ground(pager.resident(), pager.contact_level());
    if (const HeightAnswer at = ground.height(100, 200); at.status == GroundStatus::ok)
        std::printf("ground at %.3f m, off by %.3f m at most\n", at.height, at.error_m);
}
