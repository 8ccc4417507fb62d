// SPDX-License-Identifier: MIT
//
// Sources:    Macklin et al. Small steps in physics simulation. SCA 2019 (substeps instead of iterations).
//             Mirtich. Timewarp and impulse-based simulation. 2000 (islands).
// Deviations: bodies that touch each other are solved together with the ground below them; then each one moves
//             alone, through its gate, and the ground has the last word.
#include "bodies/body_world_state.h"

#include "bodies/step/body_depth.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::RigidBody;

constexpr double kSleepSpeed = 0.03;  // metres a second, of the fastest point
constexpr double kSleepDelay = 0.5;   // seconds
constexpr std::size_t kBlock = 16;    // bodies that a thread takes at once

}  // namespace

BodyWorld::State::State(const BodyWorldSettings& world_settings)
    : settings(world_settings),
      team(world_settings.worker_count),
      meetings(world_settings.broadphase) {}

std::size_t BodyWorld::State::add(const RigidBody& body, internal::CentredShape&& shape,
                                  const BodySettings& own_settings, const BodyState& state) {
    const std::size_t index = bodies.size();
    parts.push_back({.shape = std::move(shape.shape)});
    frames.push_back(shape.body_from_centred);
    bodies.push_back(body);
    bodies.back().parts = {&parts.back(), 1};
    states.emplace_back();
    body_settings.push_back(own_settings);
    needs.emplace_back();
    looks.emplace_back();
    before.emplace_back();
    totals.emplace_back();
    answers.emplace_back();
    mobility.push_back(internal::Mobility::moving);
    quiet_times.push_back(0.0);
    sleep_groups.push_back(static_cast<std::uint32_t>(index));
    waits.push_back(0);
    in_island.push_back(0);
    lifts.push_back(0.0);
    replace(index, state);
    return index;
}

void BodyWorld::State::replace(std::size_t index, const BodyState& state) {
    // Whoever slept on it or beside it may have lost what held it.
    if (is_asleep(index)) wake_group(sleep_groups[index]);
    Pose pose = internal::to_centred(state.pose, frames[index]);
    pose.rotation = orthonormalized(pose.rotation);
    static_cast<internal::BodyMotion&>(bodies[index]) = {
        .pose = pose, .velocity = {state.velocity, state.angular_velocity}};
    looks[index] = {};
    quiet_times[index] = 0.0;
    states[index] = state;
    states[index].condition = BodyCondition::awake;
}

void BodyWorld::State::set_velocity(std::size_t index, const internal::Twist& velocity) {
    if (is_asleep(index)) wake_group(sleep_groups[index]);
    bodies[index].velocity = velocity;
    quiet_times[index] = 0.0;
    states[index].velocity = velocity.linear;
    states[index].angular_velocity = velocity.angular;
}

void BodyWorld::State::wake_group(std::uint32_t group) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || sleep_groups[i] != group) continue;
        states[i].condition = BodyCondition::awake;
        quiet_times[i] = 0.0;
    }
}

StepReport BodyWorld::State::step(const Ground& ground, double dt) {
    begin_step();
    const double substep_count = internal::count_substeps(dt, settings.max_substep);
    const double substep = dt / substep_count;
    for (double done = 0.0; done < substep_count; done += 1.0) {
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            if (!is_asleep(i) && waits[i] == 0) {
                bodies[i].velocity.linear += settings.gravity * substep;
            }
        }
        if (settings.bodies_meet && bodies.size() > 1) meet(ground, substep);
        team.run_blocks(bodies.size(), kBlock,
                        [&](std::size_t i) { live_substep(i, ground, substep); });
    }

    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
        if (!is_asleep(i) && waits[i] == 0) lifts[i] = internal::greatest_lift(bodies[i], ground);
    });
    StepReport report;
    for (std::size_t i = 0; i < bodies.size(); ++i) finish_body(i, ground, report);
    report.touching_pairs = meetings.touching_pair_count();
    report.islands = meetings.islands().count();
    if (settings.allow_sleep) fall_asleep(dt);
    return report;
}

void BodyWorld::State::begin_step() {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        // Nothing seen is kept over a step: what a body does must not depend on what is loaded elsewhere.
        looks[i].begin_step();
        before[i] = bodies[i];
        totals[i] = {};
        waits[i] = 0;
    }
}

/// Lets bodies act on each other, and wakes who is met.
void BodyWorld::State::meet(const Ground& ground, double substep) {
    using internal::Mobility;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const BodyCondition condition = states[i].condition;
        mobility[i] = condition == BodyCondition::asleep   ? Mobility::asleep
                      : condition == BodyCondition::parked ? Mobility::fixed
                                                           : Mobility::moving;
    }
    meetings.find(bodies, sleep_groups, mobility, substep, team);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || mobility[i] != Mobility::moving) continue;
        states[i].condition = BodyCondition::awake;
        quiet_times[i] = 0.0;
    }
    const double gravity = internal::length(settings.gravity);
    meetings.solve(bodies, looks, answers, ground, gravity, substep, team);
}

void BodyWorld::State::live_substep(std::size_t index, const Ground& ground, double substep) {
    if (is_asleep(index) || waits[index] != 0) return;
    RigidBody& body = bodies[index];
    const double gravity = internal::length(settings.gravity);
    // A part of the substep may be over.
    internal::SubstepAnswer answer = answers[index];
    if (answer.resident) {
        const double left = substep - answer.simulated_time - answer.lost_time;
        answer.add(internal::step_body(body, looks[index], ground, gravity, left,
                                       !meetings.islands().has(index)));
    }
    answers[index] = {};
    totals[index].add(answer);
    if (!answer.resident) {
        // The whole step waits: what was moved so far is taken back.
        static_cast<internal::BodyMotion&>(body) = before[index];
        looks[index].undo_step();
        states[index].condition = BodyCondition::parked;
        waits[index] = 1;
        return;
    }
    // Whoever fell off the world's side may not come back in below the ground. The side is no
    // surface that could push, so only the way in is taken from the body, and it falls on.
    if (states[index].condition == BodyCondition::left_world && answer.lost_time > 0.0) {
        body.velocity.linear.x() = 0.0;
        body.velocity.linear.y() = 0.0;
    }
}

void BodyWorld::State::finish_body(std::size_t index, const Ground& ground, StepReport& report) {
    BodyState& state = states[index];
    if (waits[index] != 0) {
        ++report.parked;
        return;
    }
    if (is_asleep(index)) {
        ++report.asleep;
        return;
    }
    const RigidBody& body = bodies[index];
    const internal::SubstepAnswer& total = totals[index];
    report.impacts += total.impacts;
    if (!total.touches && internal::is_outside(ground, body.pose.translation)) {
        state.condition = BodyCondition::left_world;
        ++report.left_world;
    } else {
        state.condition = BodyCondition::awake;
        ++report.awake;
        report.simulated_time += total.simulated_time;
        report.lost_time += total.lost_time;
        const double depth = internal::deepest(body, ground, lifts[index],
                                               std::min(report.max_depth_m, body.tolerance));
        report.max_depth_m = std::max(report.max_depth_m, depth);
        if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
    }
    state.pose = internal::from_centred(body.pose, frames[index]);
    state.velocity = body.velocity.linear;
    state.angular_velocity = body.velocity.angular;
}

/// Puts to sleep what has been slow and held for a while: islands as a whole, bodies on the ground alone.
void BodyWorld::State::fall_asleep(double dt) {
    const internal::Islands& islands = meetings.islands();
    std::fill(in_island.begin(), in_island.end(), std::uint8_t{0});
    for (std::size_t island = 0; island < islands.count(); ++island) {
        for (const std::uint32_t body : islands.bodies(island)) in_island[body] = 1;
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (states[i].condition == BodyCondition::parked) continue;  // no time passes for it
        const bool is_held = in_island[i] != 0 || totals[i].touches;
        const bool is_quiet = states[i].condition == BodyCondition::awake && is_held &&
                              !bodies[i].started_deep &&
                              internal::greatest_speed(bodies[i]) < kSleepSpeed;
        quiet_times[i] = is_quiet ? quiet_times[i] + dt : 0.0;
        if (in_island[i] == 0 && quiet_times[i] >= kSleepDelay) {
            put_to_sleep(i, static_cast<std::uint32_t>(i));
        }
    }
    for (std::size_t island = 0; island < islands.count(); ++island) {
        const std::span<const std::uint32_t> members = islands.bodies(island);
        const bool is_quiet = std::all_of(members.begin(), members.end(), [&](std::uint32_t body) {
            return quiet_times[body] >= kSleepDelay;
        });
        if (!is_quiet) continue;
        for (const std::uint32_t body : members) put_to_sleep(body, members.front());
    }
}

void BodyWorld::State::put_to_sleep(std::size_t index, std::uint32_t group) {
    bodies[index].velocity = {};
    states[index].velocity.setZero();
    states[index].angular_velocity.setZero();
    states[index].condition = BodyCondition::asleep;
    sleep_groups[index] = group;
}

}  // namespace terrane
