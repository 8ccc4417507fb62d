// SPDX-License-Identifier: MIT
// Bodies that begin above difficult grounds, at any speed, spin and time step: none falls through.
#include "support/input.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <cmath>
#include <vector>

using namespace terrane;
using fuzz::require;

namespace {

constexpr double kLow = 8.0, kHigh = 120.0;  // where bodies begin, x and y
constexpr double kSteepest = 5.0;            // of the grounds' slopes

BodyState take_state(fuzz::Input& input) {
    BodyState state;
    state.pose.rotation = input.rotation();
    state.pose.translation = {input.between(kLow, kHigh), input.between(kLow, kHigh),
                              input.between(0.0, 60.0)};
    state.velocity = input.vector(-3000.0, 3000.0);
    state.angular_velocity = input.vector(-100.0, 100.0);
    return state;
}

/// Adds a body where it is apart from the ground.
void add_body(World& world, fuzz::Input& input, const Ground& ground, std::vector<BodyId>& bodies) {
    BodySettings settings{.shape = fuzz::take_simple_shape(input)};
    settings.restitution = input.between(0.0, 1.0);
    settings.friction = input.between(0.0, 2.0);
    settings.mass = input.between(0.01, 1000.0);
    const BodyState state = take_state(input);
    const LiftAnswer lift = compute_lift(settings.shape, state.pose, ground);
    if (lift.status != QueryStatus::ok || lift.lift > 0.0) return;
    if (const Result<BodyId> id = world.add(settings, state); id) bodies.push_back(*id);
}

/// The middle of a body is in it: it is at most about the body's tolerance below the surface.
void check_above(const World& world, const Ground& ground, std::vector<BodyId>& bodies) {
    std::erase_if(
        bodies, [&](BodyId id) { return world.state(id).condition == BodyCondition::left_world; });
    for (const BodyId id : bodies) {
        const WorldPos& p = world.state(id).pose.translation;
        require(p.allFinite(), "a body's position is finite");
        const HeightAnswer height = ground.height(p.x(), p.y());
        const double tolerance = default_contact_tolerance(world.settings(id).shape);
        require(height.status != QueryStatus::ok ||
                    p.z() >= height.height - 2.0 * (1.0 + kSteepest) * tolerance,
                "no body is below the ground");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const Ground& ground = fuzz::take_ground(input);
    WorldSettings settings;
    settings.max_substep = input.between(1.0 / 240.0, 1.0 / 20.0);
    settings.collide_bodies = input.flag();
    World world = World::create(settings).value();
    std::vector<BodyId> bodies;
    for (int count = 1 + input.below(4); count > 0; --count) add_body(world, input, ground, bodies);
    const double dt = input.between(1.0 / 240.0, 1.0 / 10.0);
    for (int step = 0; step < 20; ++step) {
        const StepReport report = world.step(ground, dt);
        require(report.too_deep == 0, "no body is deeper than its tolerance");
        require(report.placed_deep == 0, "no body was placed in the ground");
        check_above(world, ground, bodies);
    }
    return 0;
}
