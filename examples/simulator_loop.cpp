// SPDX-License-Identifier: MIT
// The whole loop of a simulator: paging, ground, a truck among bodies, and the mesh, in the order of a frame.
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

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
    // Once. value() throws where a setting is out of range; check error() where settings are user data.
    const auto source = FractalHeights::create({.seed = 7}).value();
    // 0 loads inside update(), so that every run is the same; a real-time simulator uses threads.
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 100'000, .max_error_px = 1.0}).value();
    World world = World::create({}).value();

    // Before anything stands on it, load the ground around the start, at contact level.
    const Pager::Ticket start = pager.require({-60, -60, 60, 60}, 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();  // blocks: only before the loop
    if (!pager.is_ready(start)) {
        std::printf("no ground to start on: %s\n", pager.last_failure().c_str());
        return 1;
    }
    const auto above_ground = [&](double x, double y, double clearance) {
        const HeightAnswer at = Ground(pager.resident(), pager.contact_level()).height(x, y);
        Pose pose;  // world_from_body
        pose.translation = {x, y, at.height + clearance};
        return pose;
    };
    const BodyId truck = world.add_vehicle(make_truck(), above_ground(0, 0, 1.5)).value();
    if (!world.set_controls(truck, VehicleControls{.throttle = 0.3})) return 1;  // of no vehicle
    for (int i = 0; i < 10; ++i) {
        BodyState state;
        state.pose = above_ground(20 + 3 * i, 0, 5);
        world.add({.shape = Sphere{.radius = 0.4}, .mass = 30}, state).value();
    }
    pager.release(start);  // from here on needs() keep the ground

    const double dt = 1.0 / 60.0;
    CameraNeed camera{.view = follow(world.vehicle(truck)->chassis.pose), .threshold_px = 1.0};
    std::uint64_t parked = 0, too_deep = 0;
    TerrainMesh mesh;
    for (int frame = 0; frame < 300; ++frame) {
        // 1. and 2. The needs of all bodies. Adopt loaded chunks and request the next ones. Never waits for a thread.
        pager.update({&camera, 1}, world.needs(), frame * dt);

        // 3. A new Ground for each step: the previous one is a snapshot of older chunks.
        const Ground ground(pager.resident(), pager.contact_level());

        // 4. Step. A body without resident ground is parked and counted, never dropped.
        const StepReport report = world.step(ground, dt);
        parked += report.parked;
        too_deep += report.too_deep;

        // 5. The mesh of what the camera sees now, from the same resident set.
        camera.view = follow(world.vehicle(truck)->chassis.pose);
        camera.velocity = world.vehicle(truck)->chassis.velocity;
        mesh = triangulator.update(pager.resident(), camera.view);
        camera.threshold_px = mesh.threshold_px;  // the pager fetches no finer than this

        // 6. Draw mesh (mesh_uploader.cpp), the wheels of world.vehicle(truck) and the bodies' world.states().
    }
    std::printf("%zu triangles, off by %.2f px at most; %llu parked, %llu too deep\n",
                mesh.triangle_count, mesh.error_px, static_cast<unsigned long long>(parked),
                static_cast<unsigned long long>(too_deep));
    return mesh.triangle_count > 0 && parked + too_deep == 0 ? 0 : 1;
}
