// SPDX-License-Identifier: MIT
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <cstdio>

int main() {
    using namespace terrane;  // value() throws where a setting is out of range
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.meshes = {.triangle_budget = 200'000}}).value();
    // A camera looks north; the ground around (100, 200) is needed at once.
    const View view = look_at({0, 0, 1500}, {0, 9000, 0}, 1.0, 1280, 720).value();
    const RequiredRegion near = terrain.require({90, 190, 110, 210}, 0.0);
    const Frame& frame = terrain.load({{.view = view}}, {}, 0.0);  // blocks; update() does not

    const TerrainMesh& mesh = frame.meshes[0];
    std::printf("%zu triangles, off by %.2f px at most\n", mesh.triangle_count, mesh.error_px);
    if (const HeightAnswer at = frame.ground.height(100, 200); at.status == QueryStatus::ok)
        std::printf("ground at %.3f m, off by %.3f m at most\n", at.height, at.error_m);
}
