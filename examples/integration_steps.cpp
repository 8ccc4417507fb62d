// SPDX-License-Identifier: MIT
// Parts of a simulator's integration, as docs/integration.md shows them, and a main() that runs them.
#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <chrono>
#include <cstdio>
#include <optional>
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

// Rays of a lidar on two threads: all read one Ground, which does not change, whatever is loaded meanwhile.
std::vector<RayAnswer> scan(const Ground& ground, const WorldPos& eye_world,
                            const std::vector<WorldPos>& ends_world) {
    std::vector<RayAnswer> answers(ends_world.size());
    const auto rays_of = [&](std::size_t first) {
        for (std::size_t i = first; i < ends_world.size(); i += 2)
            answers[i] = ground.ray(eye_world, ends_world[i]);
    };
    std::jthread other(rays_of, std::size_t{1});
    rays_of(0);
    return answers;
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
    const Ground& ground = terrain.load({}, world.needs(), time_s).ground;
    const WorldPos eye = world.state(ball).pose.translation;
    std::vector<WorldPos> ends;
    for (int i = -2; i <= 2; ++i) ends.push_back(eye + Eigen::Vector3d(i, 1.0, -6.0));
    const std::vector<RayAnswer> hits = scan(ground, eye, ends);
    const std::optional<double> height = height_or_last(ground, eye.x(), eye.y(), std::nullopt);
    std::printf("%s; height %.3f m; the first ray has %s the ground\n",
                has_moved ? "teleported" : "still there", height.value_or(0.0),
                hits[0].status == QueryStatus::ok ? "met" : "not met");
    return has_moved && height && hits[0].status == QueryStatus::ok ? 0 : 1;
}
