// SPDX-License-Identifier: MIT
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <cstdio>

int main() {
    using namespace terrane;  // value() throws where a setting is out of range
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    World world = World::create({}).value();
    Pose start;  // 1.5 m above the ground: a truck that drives by itself
    start.translation = {0, 0, source->height(0, 0) + 1.5};
    const BodyId truck = world.add_vehicle(make_truck(), start).value();
    if (!world.set_controls(truck, VehicleControls{.throttle = 0.3})) return 1;
    for (int frame = 0; frame < 300; ++frame) {
        pager.update({}, world.needs(),
                     frame / 60.0);      // requests the ground around it; does not wait
        if (frame == 0) pager.finish();  // waits, once, until the first ground is there
        world.step(Ground(pager.resident(), pager.contact_level()), 1.0 / 60.0);
    }
    const WorldPos end = world.vehicle(truck)->chassis.pose.translation;
    std::printf("drove to (%.1f, %.1f, %.1f)\n", end.x(), end.y(), end.z());
}
