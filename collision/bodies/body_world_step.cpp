// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Solver2D. 2024 (contacts found once a step, substeps on them).
//             Mirtich. Timewarp and impulse-based simulation. 2000 (islands).
// Deviations: islands are solved together with their ground contacts on poses that are scratch; then each body makes
//             its net displacement alone against its offset surface, so that the ground constraint holds whatever the
//             islands' solution.
#include "bodies/body_world_state.h"
#include "bodies/step/body_depth.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::RigidBody;

constexpr double kSleepSpeed = 0.03;  // metres a second, of the fastest point
constexpr double kSleepDelay = 0.5;   // seconds
/// Contacts are found once in so many substeps.
constexpr double kSubstepsPerCollisionStep = 2.0;
constexpr std::size_t kBlock = 16;  // bodies that a thread takes at a time

}  // namespace

BodyWorld::State::State(const BodyWorldSettings& world_settings)
    : settings(world_settings),
      team(world_settings.worker_count),
      island_solver(world_settings.broadphase, world_settings.bodies_meet) {}

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
    ground_contacts.emplace_back();
    before.emplace_back();
    totals.emplace_back();
    starts.emplace_back();
    mobility.push_back(internal::Mobility::moving);
    quiet_times.push_back(0.0);
    sleep_groups.push_back(static_cast<std::uint32_t>(index));
    is_parked.push_back(0);
    lifts.push_back(0.0);
    replace(index, state);
    return index;
}

void BodyWorld::State::replace(std::size_t index, const BodyState& state) {
    // Bodies that sleep with it may have lost their support.
    if (is_asleep(index)) wake_group(sleep_groups[index]);
    Pose pose = internal::to_centred(state.pose, frames[index]);
    pose.rotation = orthonormalized(pose.rotation);
    static_cast<internal::BodyMotion&>(bodies[index]) = {
        .pose = pose, .velocity = {state.velocity, state.angular_velocity}};
    ground_contacts[index] = {};
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
    for (double done = 0.0; done < substep_count; done += kSubstepsPerCollisionStep) {
        const double count = std::min(kSubstepsPerCollisionStep, substep_count - done);
        take_collision_step(ground, {.gravity = settings.gravity,
                                     .duration = count * substep,
                                     .substep_count = static_cast<int>(count)});
    }

    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
        if (!is_asleep(i) && is_parked[i] == 0) {
            lifts[i] = internal::greatest_lift(bodies[i], ground);
        }
    });
    StepReport report;
    for (std::size_t i = 0; i < bodies.size(); ++i) finish_body(i, ground, report);
    report.touching_pairs = island_solver.touching_pair_count();
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t i = 0; i < islands.count(); ++i) {
        if (!islands.links(i).empty()) ++report.islands;
    }
    if (settings.allow_sleep) fall_asleep(dt);
    return report;
}

void BodyWorld::State::begin_step() {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        // Cached contacts are not kept over a step: the result must not depend on what is loaded elsewhere.
        ground_contacts[i].begin_step();
        before[i] = bodies[i];
        totals[i] = {};
        is_parked[i] = 0;
    }
}

void BodyWorld::State::take_collision_step(const Ground& ground, const internal::StepSpan& span) {
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
        if (is_stepped(i)) begin_body(i, ground, span);
    });
    find_islands(ground, span);
    island_solver.step(bodies, ground_contacts, span, team);
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) { end_body(i, ground, span); });
}

void BodyWorld::State::begin_body(std::size_t index, const Ground& ground,
                                  const internal::StepSpan& span) {
    starts[index] =
        internal::begin_collision_step(bodies[index], ground_contacts[index], ground, span);
}

/// Finds the bodies that touch, and wakes sleepers that are touched.
void BodyWorld::State::find_islands(const Ground& ground, const internal::StepSpan& span) {
    using internal::Mobility;
    using internal::StepStart;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const bool is_moving = is_stepped(i) && starts[i].kind == StepStart::Kind::moving;
        mobility[i] = is_asleep(i) ? Mobility::asleep
                      : is_moving  ? Mobility::moving
                                   : Mobility::fixed;
    }
    island_solver.find(bodies, sleep_groups, mobility, span, team);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || mobility[i] != Mobility::moving) continue;
        states[i].condition = BodyCondition::awake;
        quiet_times[i] = 0.0;
        begin_body(i, ground, span);
    }
}

void BodyWorld::State::end_body(std::size_t index, const Ground& ground,
                                const internal::StepSpan& span) {
    using internal::StepStart;
    if (!is_stepped(index)) return;
    RigidBody& body = bodies[index];
    const StepStart& start = starts[index];
    internal::SubstepAnswer answer{.resident = false};
    if (start.kind == StepStart::Kind::moving) {
        answer = internal::end_collision_step(body, ground_contacts[index], ground, start, span);
        if (island_solver.has_struck_ground(index)) ++answer.impacts;
    } else if (start.kind == StepStart::Kind::too_deep) {
        body.pose = start.pose;
        answer = internal::recover_for_step(body, ground, span);
    }
    totals[index].add(answer);
    if (!answer.resident) {
        // The body parks for the whole step: its motion so far is undone.
        static_cast<internal::BodyMotion&>(body) = before[index];
        ground_contacts[index].undo_step();
        states[index].condition = BodyCondition::parked;
        is_parked[index] = 1;
        return;
    }
    // A body that fell off the world may not come back in below the ground. The ground's side has no surface that
    // could resolve the contact, so the horizontal velocity is removed, and the body falls on.
    if (answer.lost_time > 0.0 && internal::is_outside(ground, body.pose.translation)) {
        body.velocity.linear.x() = 0.0;
        body.velocity.linear.y() = 0.0;
    }
}

void BodyWorld::State::finish_body(std::size_t index, const Ground& ground, StepReport& report) {
    BodyState& state = states[index];
    if (is_parked[index] != 0) {
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

/// Puts islands to sleep whose bodies have been slow and supported for kSleepDelay.
void BodyWorld::State::fall_asleep(double dt) {
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t island = 0; island < islands.count(); ++island) {
        const std::span<const std::uint32_t> members = islands.bodies(island);
        const bool has_links = !islands.links(island).empty();
        bool is_quiet = true;
        for (const std::uint32_t body : members) {
            if (states[body].condition == BodyCondition::parked) {  // no time passes for it
                is_quiet = is_quiet && quiet_times[body] >= kSleepDelay;
                continue;
            }
            const bool is_held = has_links || totals[body].touches;
            const bool is_slow = states[body].condition == BodyCondition::awake && is_held &&
                                 internal::greatest_speed(bodies[body]) < kSleepSpeed;
            quiet_times[body] = is_slow ? quiet_times[body] + dt : 0.0;
            is_quiet = is_quiet && quiet_times[body] >= kSleepDelay;
        }
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
