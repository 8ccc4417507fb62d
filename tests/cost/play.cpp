// SPDX-License-Identifier: MIT
#include "cost/play.h"

#include "support/hash.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <fstream>
#include <string>

namespace terrane::test {
namespace {

constexpr double kStep = 1.0 / 60.0;
constexpr double kSpeed = 100.0;     // of the camera, m/s
constexpr double kAltitude = 150.0;  // of the camera above the ground at (0, 0), metres
constexpr double kBodySpacing = 3.0;

// North over the bodies' place, 10 degrees down: the tangent is 0.176.
View flight_view(double ground_z, int frame) {
    const WorldPos eye(30.0, -800.0 + kSpeed * kStep * frame, ground_z + kAltitude);
    return look_at(eye, eye + Eigen::Vector3d(0.0, 100.0, -17.6), 1.0, 1280, 720).value();
}

// Spheres and boxes in turn, on a square grid, 0.1 to 0.7 m above the ground.
Result<void> add_bodies(World& world, const Ground& ground, int count) {
    int side = 1;
    while (side * side < count) ++side;
    for (int i = 0; i < count; ++i) {
        const double x = kBodySpacing * (i % side - 0.5 * (side - 1));
        const double y = kBodySpacing * (i / side - 0.5 * (side - 1));
        const HeightAnswer at = ground.height(x, y);
        BodyState state;
        state.pose.translation = {x, y, at.height + 0.6 + 0.1 * (i % 5)};
        BodySettings settings;
        settings.mass = 30.0;
        if (i % 2 == 0) {
            settings.shape = Sphere{.radius = 0.4};
        } else {
            settings.shape = Box{.half_extents = {0.3, 0.4, 0.5}};
        }
        if (const auto added = world.add(settings, state); !added)
            return tl::unexpected(added.error());
    }
    return {};
}

int count_threads() {
    std::ifstream status("/proc/self/status");
    const std::string key = "Threads:";
    for (std::string line; std::getline(status, line);)
        if (line.starts_with(key)) return std::stoi(line.substr(key.size()));
    return 0;
}

}  // namespace

Result<CostRun> play_cost_scene(const CostScene& scene, int frames) {
    const int threads_before = count_threads();
    auto pager = Pager::create(scene.source, {.worker_count = 0});
    if (!pager) return tl::unexpected(pager.error());
    auto triangulator =
        Triangulator::create(*scene.source, {.triangle_budget = 100'000, .max_error_px = 1.0});
    if (!triangulator) return tl::unexpected(triangulator.error());
    auto world = World::create({});
    if (!world) return tl::unexpected(world.error());

    const Pager::Ticket start = pager->require({-60.0, -60.0, 60.0, 60.0}, 0.0);
    pager->update({}, {}, 0.0);
    pager->finish();
    const double ground_z = scene.source->height(0.0, 0.0);
    {
        const Ground ground(pager->resident(), pager->contact_level());
        if (const auto added = add_bodies(*world, ground, scene.body_count); !added)
            return tl::unexpected(added.error());
    }
    pager->release(start);

    CostRun run;
    Hash hash;
    CameraNeed camera{
        .view = flight_view(ground_z, 0), .velocity = {0.0, kSpeed, 0.0}, .threshold_px = 1.0};
    for (int frame = 0; frame < frames; ++frame) {
        camera.view = flight_view(ground_z, frame);
        pager->update({&camera, 1}, world->needs(), frame * kStep);

        const Ground ground(pager->resident(), pager->contact_level());
        const StepReport report = world->step(ground, kStep);
        run.awake_bodies += report.awake;
        run.fell_through += report.too_deep;

        std::span<const TriangleDemand> demands;
        if (scene.objects) demands = scene.objects->demands(camera.view);
        const TerrainMesh mesh = triangulator->update(pager->resident(), camera.view, demands);
        if (scene.objects) run.object_triangles += scene.objects->draw(mesh.others_threshold_px);
        camera.threshold_px = mesh.threshold_px;
        run.ground_triangles += mesh.triangle_count;
        run.late_chunks += pager->stats().late_chunks;
        hash.add(mesh.triangle_count);
        hash.add(mesh.error_px);
    }
    hash.add(world->state_hash());
    run.hash = hash.value();
    run.threads = count_threads();
    run.threads_begun = run.threads - threads_before;
    return run;
}

}  // namespace terrane::test
