// SPDX-License-Identifier: MIT
#include "trade/trials/drop_trial.h"

#include "drop/drop_layout.h"
#include "trade/table/thread_clock.h"
#include "world/placed_body.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

// Potential and kinetic energy of a sphere of radius 0.5 m and 1 kg, joules.
double energy_of(const BodyState& state) {
    constexpr double kGravity = 9.81, kInertia = 0.4 * 0.25;
    return kGravity * state.pose.translation.z() + 0.5 * state.velocity.squaredNorm() +
           0.5 * kInertia * state.angular_velocity.squaredNorm();
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
    std::vector<double> energies;
    for (const BodyState& state : world->states()) energies.push_back(energy_of(state));
    double gained = 0.0, lost = 0.0, taken_s = 0.0;
    Clock::duration taken{};
    for (std::size_t step = 0; step < steps; ++step) {
        const Clock::time_point start = Clock::now();
        const double start_s = thread_seconds();
        const StepReport report = world->step(ground, trial.dt);
        taken_s += thread_seconds() - start_s;
        taken += Clock::now() - start;
        figures.max_depth_m = std::max(figures.max_depth_m, report.max_depth_m);
        figures.fell_through += static_cast<double>(report.too_deep);
        for (std::size_t i = 0; i < energies.size(); ++i) {
            const double after = energy_of(world->states()[i]);
            (after > energies[i] ? gained : lost) += std::abs(after - energies[i]);
            energies[i] = after;
        }
    }
    const double simulated = static_cast<double>(steps) * trial.dt;
    figures.ms = 1e3 * taken_s / simulated;
    figures.wall_ms = std::chrono::duration<double, std::milli>(taken).count() / simulated;
    figures.drift = lost > 0.0 ? gained / lost : 0.0;
    return figures;
}

}  // namespace terrane::tools
