// SPDX-License-Identifier: MIT
#include "trade/trials/drop_trial.h"

#include "drop/drop_layout.h"
#include "world/placed_body.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

// Potential and kinetic energy of spheres of radius 0.5 m and 1 kg, joules.
double energy_of(std::span<const BodyState> states) {
    constexpr double kGravity = 9.81, kInertia = 0.4 * 0.25;
    double energy = 0.0;
    for (const BodyState& state : states) {
        energy += kGravity * state.pose.translation.z() + 0.5 * state.velocity.squaredNorm() +
                  0.5 * kInertia * state.angular_velocity.squaredNorm();
    }
    return energy;
}

CommandResult<World> make_trial_world(const DropTrial& trial, const Ground& ground) {
    Result<World> world = World::create(trial.world);
    if (!world) return pass_on(world.error());
    const Result<World> obstacles = World::create({});
    if (!obstacles) return pass_on(obstacles.error());
    std::vector<PlacedBody> bodies =
        lay_out({.shape = DropShape::sphere, .count = trial.count, .speed = trial.speed}, ground,
                *obstacles);
    if (bodies.empty()) return failure("no body finds ground at the terrain's centre");
    for (PlacedBody& body : bodies) body.settings.contact_tolerance = trial.contact_tolerance;
    const Result<std::vector<BodyId>> added = add_bodies(bodies, *world);
    if (!added) return pass_on(added.error());
    return std::move(*world);
}

}  // namespace

CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground) {
    using Clock = std::chrono::steady_clock;
    CommandResult<World> world = make_trial_world(trial, ground);
    if (!world) return pass_on(world.error());
    const auto steps =
        static_cast<std::size_t>(std::max(1.0, std::round(trial.seconds / trial.dt)));
    DropFigures figures;
    double before = energy_of(world->states());
    double gained = 0.0, lost = 0.0;
    Clock::duration taken{};
    for (std::size_t step = 0; step < steps; ++step) {
        const Clock::time_point start = Clock::now();
        const StepReport report = world->step(ground, trial.dt);
        taken += Clock::now() - start;
        figures.max_depth_m = std::max(figures.max_depth_m, report.max_depth_m);
        figures.fell_through += static_cast<double>(report.too_deep);
        const double after = energy_of(world->states());
        (after > before ? gained : lost) += std::abs(after - before);
        before = after;
    }
    figures.ms = std::chrono::duration<double, std::milli>(taken).count() /
                 (static_cast<double>(steps) * trial.dt);
    figures.drift = lost > 0.0 ? gained / lost : 0.0;
    return figures;
}

}  // namespace terrane::tools
