// SPDX-License-Identifier: MIT
// The whole loop of a simulator: paging, ground, a truck among bodies, and the mesh, in the order of a frame.
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <cstdio>

using namespace terrane;

namespace {

// A view from behind and above the truck. The x axis of a chassis is forward.
View follow(const Pose& world_from_chassis) {
    const WorldPos eye = world_from_chassis.translation -
                         12.0 * world_from_chassis.rotation.col(0) + 6.0 * Eigen::Vector3d::UnitZ();
    return look_at(eye, world_from_chassis.translation, 1.0, 1280, 720).value();
}

}  // namespace

int main() {
    // Done once. value() throws if a setting is out of range; check error() if settings are user data.
    const auto source = FractalHeights::create({.seed = 7}).value();
    // A worker_count of 0 loads inside update(), so that every run is the same; a real-time simulator uses threads.
    Terrain terrain =
        Terrain::create(source, {.paging = {.worker_count = 0},
                                 .meshes = {.triangle_budget = 100'000, .max_error_px = 1.0}})
            .value();
    World world = World::create({}).value();

    // Before anything stands on it, load the ground around the start, at contact level.
    RequiredRegion start = terrain.require({-60, -60, 60, 60}, 0.0);
    terrain.load({}, {}, 0.0);  // blocks: only before the loop
    if (!start.is_ready()) {
        std::printf("no ground to start on: %s\n", terrain.pager().last_failure().c_str());
        return 1;
    }
    const auto above_ground = [&](double x, double y, double clearance) {
        const HeightAnswer at = terrain.frame().ground.height(x, y);
        Pose pose;  // world_from_body
        pose.translation = {x, y, at.height + clearance};
        return pose;
    };
    const BodyId truck = world.add_vehicle(make_truck(), above_ground(0, 0, 1.5)).value();
    if (!world.set_controls(truck, VehicleControls{.throttle = 0.3})) return 1;  // no such vehicle
    for (int i = 0; i < 10; ++i) {
        const Pose above = above_ground(20 + 3 * i, 0, 5);
        world.add({.shape = Sphere{.radius = 0.4}, .mass = 30}, {.pose = above}).value();
    }
    start.release();  // from here on world.needs() keeps the ground resident

    const double dt = 1.0 / 60.0;
    std::uint64_t parked = 0, too_deep = 0;
    for (int i = 0; i < 300; ++i) {
        // 1. Pass the camera and the needs of all bodies. update() adopts loaded chunks, requests the next ones and
        //    triangulates the view. It never waits for a thread.
        const BodyState& chassis = world.state(truck);
        const Camera camera{.view = follow(chassis.pose), .velocity = chassis.velocity};
        const Frame& frame = terrain.update({camera}, world.needs(), i * dt);

        // 2. Step on the ground of this frame. A body without resident ground is parked and counted, never dropped.
        const StepReport report = world.step(frame.ground, dt);
        parked += report.parked;
        too_deep += report.too_deep;

        // 3. Draw frame.meshes[0] (mesh_uploader.cpp), the wheels of world.vehicle(truck) and the bodies' states.
    }
    const TerrainMesh& mesh = terrain.frame().meshes[0];
    std::printf("%zu triangles, off by %.2f px at most; %llu parked, %llu too deep\n",
                mesh.triangle_count, mesh.error_px, static_cast<unsigned long long>(parked),
                static_cast<unsigned long long>(too_deep));
    return mesh.triangle_count > 0 && parked + too_deep == 0 ? 0 : 1;
}
