// SPDX-License-Identifier: MIT
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <cstdio>

int main() {
    using namespace terrane;  // value() throws where a setting is out of range
    Terrain terrain = Terrain::create(FractalHeights::create({.seed = 7}).value()).value();
    World world = World::create({}).value();
    const WorldPos start(0, 0, terrain.source().height(0, 0) + 1.5);
    const BodyId truck = world.add_vehicle(make_truck(), {.translation = start}).value();
    if (!world.set_controls(truck, VehicleControls{.throttle = 0.3})) return 1;
    const View view = look_at(start + WorldPos(-30, 0, 20), start, 1.0, 1280, 720).value();
    terrain.load({{.view = view}}, world.needs(), 0.0);  // blocks, once, for the first ground
    for (int i = 1; i <= 300; ++i) {
        const Frame& frame = terrain.update({{.view = view}}, world.needs(), i / 60.0);
        world.step(frame.ground, 1.0 / 60.0);
        if (i == 300) std::printf("%zu triangles\n", frame.meshes[0].triangle_count);  // draw it
    }
    std::printf("drove %.1f m east\n", world.state(truck).pose.translation.x());
}
