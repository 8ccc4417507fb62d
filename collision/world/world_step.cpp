// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Solver2D. 2024 (contacts found once a step, substeps on them).
//             Mirtich. Timewarp and impulse-based simulation. 2000 (islands).
// Deviations: islands are solved together with their ground contacts on poses that are scratch; then each body makes
//             its net displacement alone against its offset surface, so that the ground constraint holds whatever the
//             islands' solution.
#include "bodies/body_checks.h"
#include "bodies/step/body_depth.h"
#include "world/world_state.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace terrane {
namespace {

using internal::Mobility;
using internal::RigidBody;
using internal::StepStart;

/// Contacts are found once in so many substeps.
constexpr double kSubstepsPerCollisionStep = 2.0;
constexpr std::size_t kBlock = 16;      // bodies that a thread takes at a time
constexpr double kMostGravity = 1e4;    // m/s^2
constexpr double kSameDuration = 1e-9;  // relative: a kinematic body reaches its pose in this step

bool is_valid_gravity(const Eigen::Vector3d& gravity) {
    return std::abs(gravity.x()) <= kMostGravity && std::abs(gravity.y()) <= kMostGravity &&
           std::abs(gravity.z()) <= kMostGravity;
}

/// Whether a body may be there.
bool is_in_reach(const WorldPos& place) {
    return std::abs(place.x()) <= internal::kMaxPlace &&
           std::abs(place.y()) <= internal::kMaxPlace && std::abs(place.z()) <= internal::kMaxPlace;
}

}  // namespace

StepReport World::State::step(const Ground& ground, double dt) {
    if (!(dt > 0.0 && dt <= kMostStep)) return {.refused_steps = 1};
    contacts.begin_step();
    if (is_idle) return idle_report;
    touch();
    begin_step();
    const double substep_count = internal::count_substeps(dt, settings.max_substep);
    const double substep = dt / substep_count;
    for (double done = 0.0; done < substep_count; done += kSubstepsPerCollisionStep) {
        const double count = std::min(kSubstepsPerCollisionStep, substep_count - done);
        take_collision_step(
            ground, {.duration = count * substep, .substep_count = static_cast<int>(count)});
    }

    if (settings.measure_depth) {
        team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
            const bool is_measured =
                is_stepped(i) || (ids.is_used(i) && type(i) == BodyType::kinematic_body);
            if (is_measured) lifts[i] = internal::greatest_lift(bodies[i], ground);
        });
    }
    StepReport report;
    bool is_moving = false;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (mobility[i] == Mobility::absent) continue;
        if (type(i) == BodyType::dynamic_body) finish_dynamic(i, ground, report);
        if (type(i) == BodyType::kinematic_body) finish_kinematic(i, dt, report);
        is_placed_anew[i] = 0;
    }
    report.touching_pairs = island_solver.touching_pair_count();
    report.skipped_pairs = island_solver.skipped_pair_count();
    report.failed_callbacks = failed_callbacks;
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t i = 0; i < islands.count(); ++i) {
        if (!islands.links(i).empty()) ++report.islands;
    }
    finish_drives(ground, dt, report);
    if (settings.report_contacts) {
        contacts.end_step(island_solver, {ids, bodies, ground_contacts, mobility});
    }
    if (settings.allow_sleep) fall_asleep(dt);
    for (std::size_t i = 0; i < bodies.size() && !is_moving; ++i) {
        is_moving = (type(i) == BodyType::dynamic_body && ids.is_used(i) && !is_asleep(i)) ||
                    mobility[i] == Mobility::driving;
    }
    if (!is_moving) {
        is_idle = true;
        ground_before.reset();
        idle_report = {.asleep = report.awake + report.asleep,
                       .kinematic_in_ground = report.kinematic_in_ground};
    }
    return report;
}

void World::State::begin_step() {
    failed_callbacks = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        is_parked[i] = 0;
        mobility[i] = ids.is_used(i) ? Mobility::fixed : Mobility::absent;
        if (!is_stepped(i)) continue;
        RigidBody& body = bodies[i];
        // Cached contacts are not kept over a step: the result must not depend on what is loaded elsewhere.
        ground_contacts[i].begin_step();
        before[i] = body;
        totals[i] = {};
        body.acceleration = gravity_of(body) + forces[i] * body.mass.inverse_mass;
        if (vehicles[i] != nullptr) vehicles[i]->begin_step();
        if (characters[i] != nullptr) characters[i]->begin_step(body.acceleration);
    }
}

/// Gravity at a body, m/s^2.
Eigen::Vector3d World::State::gravity_of(const RigidBody& body) {
    if (!settings.callbacks.gravity_at) return settings.gravity;
    try {
        const Eigen::Vector3d gravity = settings.callbacks.gravity_at(body.pose.translation);
        if (is_valid_gravity(gravity)) return gravity;
    } catch (...) {  // counted, as what is not valid is
    }
    ++failed_callbacks;
    return settings.gravity;
}

bool World::State::may_collide(std::uint32_t a, std::uint32_t b) {
    try {
        return settings.callbacks.may_collide(ids.id(a), ids.id(b));
    } catch (...) {
        ++failed_callbacks;
        return true;
    }
}

void World::State::take_collision_step(const Ground& ground, const internal::StepSpan& span) {
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
        if (is_stepped(i)) begin_body(i, ground, span);
    });
    begin_drives(ground, span.duration);
    find_islands(ground, span);
    choose_drives();
    island_solver.step(bodies, ground_contacts, {wheel_sets, feet}, span, team);
    if (settings.report_contacts) contacts.add_impulses(island_solver, mobility);
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) { end_body(i, ground, span); });
    end_drives(ground, span.duration);
    ground_before = ground;
}

void World::State::begin_body(std::size_t index, const Ground& ground,
                              const internal::StepSpan& span) {
    RigidBody& body = bodies[index];
    if (!torques[index].isZero(0.0)) {
        body.velocity.angular +=
            internal::apply_tensor(body.pose.rotation, body.mass.inverse_inertia, torques[index]) *
            span.duration;
    }
    starts[index] = internal::begin_collision_step(body, ground_contacts[index], ground,
                                                   ground_before ? &*ground_before : nullptr, span);
}

void World::State::set_mobility(std::size_t index) {
    if (mobility[index] == Mobility::absent) return;
    if (type(index) != BodyType::dynamic_body) {
        mobility[index] = drives(index) ? Mobility::driving : Mobility::fixed;
    } else if (is_asleep(index)) {
        mobility[index] = Mobility::asleep;
    } else if (!is_stepped(index) || starts[index].kind == StepStart::Kind::unresident) {
        mobility[index] = Mobility::fixed;
    } else {
        // A body that recovers from the ground moves whatever touches it.
        const bool is_deep = starts[index].kind == StepStart::Kind::too_deep;
        mobility[index] = is_deep ? Mobility::driving : Mobility::moving;
    }
}

/// Finds the bodies that touch, and wakes sleepers that are touched.
void World::State::find_islands(const Ground& ground, const internal::StepSpan& span) {
    for (std::size_t i = 0; i < bodies.size(); ++i) set_mobility(i);
    island_solver.find(bodies, sleep_groups, wheel_links, mobility, span, team);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || mobility[i] != Mobility::moving) continue;
        states[i].condition = BodyCondition::awake;
        quiet_times[i] = 0.0;
        ground_contacts[i].begin_step();
        before[i] = bodies[i];
        totals[i] = {};
        bodies[i].acceleration = gravity_of(bodies[i]);
        if (vehicles[i] != nullptr) vehicles[i]->begin_step();
        if (characters[i] != nullptr) characters[i]->begin_step(bodies[i].acceleration);
        begin_body(i, ground, span);
    }
}

void World::State::end_body(std::size_t index, const Ground& ground,
                            const internal::StepSpan& span) {
    RigidBody& body = bodies[index];
    if (mobility[index] == Mobility::driving && type(index) == BodyType::kinematic_body) {
        for (int i = 0; i < span.substep_count; ++i) {
            const Motion motion{body.pose, body.velocity.linear * span.substep(),
                                body.velocity.angular * span.substep()};
            const Pose next = motion.at(1.0);
            if (!is_in_reach(next.translation)) {
                body.velocity = {};
                break;
            }
            body.pose = next;
        }
    }
    if (!is_stepped(index)) return;
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
    if (!answer.resident || !is_in_reach(body.pose.translation)) {
        // The body parks for the whole step: its motion so far is undone.
        static_cast<internal::BodyMotion&>(body) = before[index];
        ground_contacts[index].undo_step();
        if (vehicles[index] != nullptr) vehicles[index]->undo_step();
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

void World::State::finish_kinematic(std::size_t index, double dt, StepReport& report) {
    RigidBody& body = bodies[index];
    if (std::optional<Pose>& target = targets[index]; target) {
        const bool reaches = std::abs(dt - target_times[index]) <= kSameDuration * dt;
        if (reaches) body.pose = *target;
        target_times[index] -= dt;
        if (reaches || target_times[index] <= 0.0) {
            body.velocity = {};
            target.reset();
        }
    }
    if (mobility[index] == Mobility::driving) publish(index);
    const bool is_in_ground =
        settings.measure_depth && !body.is_sensor && lifts[index] > body.tolerance;
    if (is_in_ground) ++report.kinematic_in_ground;
}

void World::State::finish_dynamic(std::size_t index, const Ground& ground, StepReport& report) {
    forces[index].setZero();
    torques[index].setZero();
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
    if (settings.report_contacts) {
        contacts.add_ground_impulse(static_cast<std::uint32_t>(index), total.impulse);
    }
    if (before[index].is_fresh && body.started_deep) ++report.placed_deep;
    if (!total.touches && internal::is_outside(ground, body.pose.translation)) {
        state.condition = BodyCondition::left_world;
        ++report.left_world;
    } else {
        state.condition = BodyCondition::awake;
        ++report.awake;
        report.simulated_time += total.simulated_time;
        report.lost_time += total.lost_time;
        if (settings.measure_depth) {
            const double depth = internal::deepest(body, ground, lifts[index],
                                                   std::min(report.max_depth_m, body.tolerance));
            report.max_depth_m = std::max(report.max_depth_m, depth);
            if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
        }
    }
    publish(index);
}

}  // namespace terrane
