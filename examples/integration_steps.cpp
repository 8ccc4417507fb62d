// SPDX-License-Identifier: MIT
// Parts of a simulator's integration, as docs/integration.md shows them, and a main() that runs them.
#include <terrane/collision/lidar.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <span>
#include <thread>
#include <vector>

using namespace terrane;

// Teleports a body once the ground at its goal is resident. The terrain tries to load it by deadline_s, on the clock of
// update(). Call finish() in every frame; it returns true when the body has been teleported.
struct Teleport {
    BodyId body;
    WorldPos goal_world = WorldPos::Zero();
    RequiredRegion region;

    void begin(Terrain& terrain, double deadline_s) {
        const double reach = 50.0;  // metres around the goal that the body may touch at first
        region = terrain.require({.west = goal_world.x() - reach,
                                  .south = goal_world.y() - reach,
                                  .east = goal_world.x() + reach,
                                  .north = goal_world.y() + reach},
                                 deadline_s);
    }
    bool finish(const Ground& ground, World& world) {
        if (!region.is_ready()) return false;
        const HeightAnswer at = ground.height(goal_world.x(), goal_world.y());
        if (at.status != QueryStatus::ok) return false;
        const WorldPos above(goal_world.x(), goal_world.y(), at.height + 1.5);
        const bool moved = world.teleport(body, {.pose = {.translation = above}}).has_value();
        region.release();  // from the next update() on needs() keep its ground
        return moved;
    }
};

// For a simulator that can run without an exact height: while ground is being loaded, the last height is used.
std::optional<double> height_or_last(const Ground& ground, double x, double y,
                                     std::optional<double> last) {
    const HeightAnswer at = ground.height(x, y);
    switch (at.status) {
        case QueryStatus::ok:
            return at.height;  // the true surface is within at.error_m
        case QueryStatus::not_resident:
            return last;            // ask again after the next update()
        case QueryStatus::outside:  // no ground there, ever
        case QueryStatus::miss:
        case QueryStatus::truncated:
        case QueryStatus::invalid:
            break;
    }
    return std::nullopt;
}

// Steps only when all bodies have their ground, for simulators in which no body may be parked.
bool step_or_wait(Terrain& terrain, World& world, double& time_s, double dt) {
    const Frame& frame = terrain.update({}, world.needs(), time_s);
    if (frame.groundless_bodies > 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return false;  // the clock stands still; loads go on
    }
    const StepReport report = world.step(frame.ground, dt);
    time_s += dt;
    return report.parked == 0;
}

// Scans with a lidar on two threads. The terrain first loads the ground that the bodies and the lidar need. All beams
// read one Ground, which does not change while other chunks are loaded.
std::vector<LidarStatus> scan(Terrain& terrain, World& world, Lidar& lidar,
                              const Pose& world_from_sensor, double time_s) {
    const std::span<const BodyNeed> of_bodies = world.needs();
    std::vector<BodyNeed> needs(of_bodies.begin(), of_bodies.end());
    needs.push_back(lidar.need(world_from_sensor));
    const Frame& frame = terrain.load({}, needs, time_s);  // blocks; in a loop, update() does not
    std::vector<LidarStatus> statuses(lidar.count());
    LidarArrays out;
    out.statuses = statuses;
    const auto scanned = lidar.scan(frame.ground, &world, world_from_sensor, out);
    return scanned ? statuses : std::vector<LidarStatus>();
}

int main() {
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source).value();
    World world = World::create({}).value();
    const WorldPos start(0, 0, source->height(0, 0) + 3.0);
    const BodyId ball =
        world.add({.shape = Sphere{.radius = 0.5}}, {.pose = {.translation = start}}).value();

    double time_s = 0.0;
    for (int tries = 0; time_s < 0.5 && tries < 60'000; ++tries)
        step_or_wait(terrain, world, time_s, 1.0 / 60.0);

    Teleport teleport{.body = ball, .goal_world = {9000, 4000, 0}};
    teleport.begin(terrain, time_s + 2.0);
    bool has_moved = false;
    for (int tries = 0; !has_moved && tries < 60'000; ++tries) {
        if (!step_or_wait(terrain, world, time_s, 1.0 / 60.0)) continue;
        has_moved = teleport.finish(terrain.frame().ground, world);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    Lidar lidar =
        Lidar::create({.max_range = 300.0, .worker_count = 2}, make_lidar_grid().value()).value();
    Pose sensor = world.state(ball).pose;
    sensor.translation.z() += 2.0;  // above the ball
    const std::vector<LidarStatus> beams = scan(terrain, world, lidar, sensor, time_s);
    const auto count = [&beams](LidarStatus status) {
        return static_cast<int>(std::ranges::count(beams, status));
    };
    const int met = count(LidarStatus::ground), undecided = count(LidarStatus::not_resident);
    const WorldPos& eye = sensor.translation;
    const std::optional<double> height =
        height_or_last(terrain.frame().ground, eye.x(), eye.y(), std::nullopt);
    std::printf("%s; height %.3f m; of %zu beams %d meet the ground, %d are undecided\n",
                has_moved ? "teleported" : "still there", height.value_or(0.0), beams.size(), met,
                undecided);
    return has_moved && height && met > 0 && undecided == 0 ? 0 : 1;
}
