// SPDX-License-Identifier: MIT
// Drops a sphere for three seconds; it must not be in the ground.
#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <cstdio>
#include <string>

namespace {

int fail(const std::string& message) {
    std::printf("%s\n", message.c_str());
    return 1;
}

}  // namespace

int main() {
    using namespace terrane;
    const auto source = FractalHeights::create({.seed = 7});
    if (!source) return fail(source.error().message);
    Result<Pager> pager = Pager::create(*source, {.worker_count = 0});
    if (!pager) return fail(pager.error().message);
    Result<World> world = World::create({});
    if (!world) return fail(world.error().message);

    BodyState start;
    start.pose.translation = {100.0, 200.0, (*source)->height(100.0, 200.0) + 10.0};
    const Sphere ball{.radius = 0.5};
    if (const auto added = world->add({.shape = ball}, start); !added) {
        return fail(added.error().message);
    }
    for (int step = 0; step < 180; ++step) {
        pager->update({}, world->needs(), step / 60.0);
        const StepReport report = world->step(pager->ground(), 1.0 / 60.0);
        if (report.too_deep + report.parked + report.left_world > 0) {
            return fail("the ball fell through, was parked or left the world");
        }
    }
    const BodyState& end = world->states()[0];
    const Ground ground = pager->ground();
    const DistanceAnswer answer = signed_distance(ball, end.pose, ground, 10.0);
    if (answer.status != QueryStatus::ok || !answer.has_ground) {
        return fail("there is no ground below the ball");
    }
    std::printf("the ball is %.4f m above the ground\n", answer.distance);
    return answer.distance >= -default_contact_tolerance(ball) ? 0 : 1;
}
