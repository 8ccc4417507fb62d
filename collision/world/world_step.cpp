// SPDX-License-Identifier: MIT
//
// A step of the world: sleep, drives, islands.
#include "world/solver/body_checks.h"
#include "world/solver/body_step.h"
#include "world/world_state.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace terrane {

// Sleeping and waking of islands.

namespace {

constexpr double kSleepSpeed = 0.03;  // metres per second, of the fastest point
constexpr double kSleepDelay = 0.5;   // seconds

}  // namespace

void World::State::wake_group(std::uint32_t group) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || sleep_groups[i] != group) continue;
        states[i].condition = BodyCondition::awake;
        quiet_times[i] = 0.0;
        show_to_drives(i);
    }
}

/// Puts islands to sleep if all their bodies have been slow and supported for kSleepDelay. An island touched by a
/// driving body stays awake.
void World::State::fall_asleep(double dt) {
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t island = 0; island < islands.count(); ++island) {
        const std::span<const std::uint32_t> members = islands.bodies(island);
        const bool has_links = !islands.links(island).empty();
        bool is_quiet = !island_solver.is_driven(island);
        for (const std::uint32_t body : members) {
            if (states[body].condition == BodyCondition::parked) {  // no time passes for it
                is_quiet = is_quiet && quiet_times[body] >= kSleepDelay;
                continue;
            }
            const internal::Vehicle* const vehicle = vehicles[body].get();
            const bool is_held =
                has_links || totals[body].touches || (vehicle != nullptr && vehicle->is_standing());
            const internal::Character* const character = characters[body].get();
            const bool may_sleep = (vehicle == nullptr || vehicle->is_braked()) &&
                                   (character == nullptr || character->is_idle());
            // Separation of overlaps moves bodies without velocity.
            const double moved =
                internal::greatest_move(bodies[body], before[body].pose, bodies[body].pose);
            const bool is_slow =
                states[body].condition == BodyCondition::awake && is_held && may_sleep &&
                internal::greatest_speed(bodies[body]) < kSleepSpeed && moved < kSleepSpeed * dt;
            quiet_times[body] = is_slow ? quiet_times[body] + dt : 0.0;
            is_quiet = is_quiet && quiet_times[body] >= kSleepDelay;
        }
        if (!is_quiet) continue;
        for (const std::uint32_t body : members) put_to_sleep(body, members.front());
    }
}

void World::State::put_to_sleep(std::size_t index, std::uint32_t group) {
    bodies[index].velocity = {};
    states[index].velocity.setZero();
    states[index].angular_velocity.setZero();
    states[index].condition = BodyCondition::asleep;
    sleep_groups[index] = group;
    ground_contacts[index].forget_proof();
    show_to_drives(index);
}

// Drives of vehicles and characters. Wheels are cast against bodies and ground once per collision step, and exert
// forces in the substeps of islands, where feet drive contacts.

using internal::Mobility;
using internal::StepStart;

void World::State::begin_drives(const Ground& ground, double duration) {
    if (vehicle_slots.empty() && character_slots.empty()) return;
    touch();
    const internal::QueryScene now = scene(ground);
    cast_wheels(now);
    team.run_blocks(character_slots.size(), 1, [&](std::size_t i) {
        const std::uint32_t slot = character_slots[i];
        if (!is_stepped(slot) || starts[slot].kind != StepStart::Kind::moving) return;
        characters[slot]->begin_collision_step(bodies[slot], {now, bodies, ids.id(slot)}, duration);
    });
}

/// Casts the wheels of all vehicles, including sleeping ones: a body that moves under a wheel wakes its vehicle.
void World::State::cast_wheels(const internal::QueryScene& now) {
    team.run_blocks(vehicle_slots.size(), 1, [&](std::size_t i) {
        const std::uint32_t slot = vehicle_slots[i];
        const bool is_moving = is_stepped(slot) && starts[slot].kind == StepStart::Kind::moving;
        if (!is_moving && !is_asleep(slot)) return;
        internal::Vehicle& vehicle = *vehicles[slot];
        if (!vehicle.cast_wheels(bodies[slot], ids.id(slot), now)) {
            starts[slot].kind = StepStart::Kind::unresident;
            return;
        }
        vehicle.wheels().begin_collision_step(bodies[slot].pose, bodies);
    });
    wheel_links.clear();
    for (const std::uint32_t slot : vehicle_slots) {
        for (const internal::WheelContact& contact : vehicles[slot]->wheels().contacts()) {
            if (!contact.touches || contact.body == internal::kNone) continue;
            const BodyPair link{std::min(slot, contact.body), std::max(slot, contact.body)};
            if (wheel_links.empty() || !(wheel_links.back() == link)) wheel_links.push_back(link);
        }
    }
}

/// Selects the drives of moving bodies.
void World::State::choose_drives() {
    wheel_sets.clear();
    feet.clear();
    if (!vehicle_slots.empty()) wheel_sets.resize(bodies.size(), nullptr);
    if (!character_slots.empty()) feet.resize(bodies.size(), nullptr);
    for (const std::uint32_t slot : vehicle_slots) {
        if (mobility[slot] == Mobility::moving) wheel_sets[slot] = &vehicles[slot]->wheels();
    }
    for (const std::uint32_t slot : character_slots) {
        if (mobility[slot] == Mobility::moving) feet[slot] = &characters[slot]->feet();
    }
}

/// Moves stopped characters onto steps, sequentially, so that each sees the positions of the others.
void World::State::end_drives(const Ground& ground, double duration) {
    for (const std::uint32_t slot : character_slots) {
        internal::Character& character = *characters[slot];
        const WorldPos& start = starts[slot].pose.translation;
        if (!is_stepped(slot) || mobility[slot] != Mobility::moving ||
            !character.is_stopped(bodies[slot], start, duration)) {
            continue;
        }
        touch();
        const internal::QueryScene now = scene(ground);
        character.end_collision_step(bodies[slot], {now, bodies, ids.id(slot)}, start, duration);
    }
}

void World::State::show_to_drives(std::size_t index) {
    if (vehicles[index] != nullptr) vehicles[index]->show(states[index]);
    if (characters[index] != nullptr) characters[index]->show(states[index]);
}

void World::State::finish_drives(const Ground& ground, double dt, StepReport& report) {
    for (const std::uint32_t slot : character_slots) characters[slot]->show(states[slot]);
    if (vehicle_slots.empty()) return;
    touch();
    const internal::QueryScene now = scene(ground);
    for (const std::uint32_t slot : vehicle_slots) {
        internal::Vehicle& vehicle = *vehicles[slot];
        if (!is_stepped(slot)) {
            vehicle.show(states[slot]);
            continue;
        }
        // If ground under a wheel is not resident, the contacts of the last collision step remain.
        vehicle.cast_wheels(bodies[slot], ids.id(slot), now);
        vehicle.end_step(states[slot], now, totals[slot].touches, dt);
        if (!settings.measure_depth) continue;
        const double depth = vehicle.wheel_depth(ground);
        report.max_depth_m = std::max(report.max_depth_m, depth);
        const internal::RigidBody& body = bodies[slot];
        if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
    }
}

// Sources:    Catto. Solver2D. 2024 (contact detection once per step, substeps on these contacts).
//             Mirtich. Timewarp and impulse-based simulation. 2000 (islands).
// Deviations: islands are solved with their ground contacts on scratch poses; then each body's net displacement is
//             applied separately against its offset surface, so that the ground constraint holds for any solution of
//             the islands.

namespace {

using internal::Mobility;
using internal::RigidBody;
using internal::StepStart;

/// Substeps per detection of contacts.
constexpr double kSubstepsPerCollisionStep = 2.0;
constexpr std::size_t kBlock = 16;      // bodies per block of a thread
constexpr double kMostGravity = 1e4;    // m/s^2
constexpr double kSameDuration = 1e-9;  // relative tolerance of target times

bool is_valid_gravity(const Eigen::Vector3d& gravity) {
    return std::abs(gravity.x()) <= kMostGravity && std::abs(gravity.y()) <= kMostGravity &&
           std::abs(gravity.z()) <= kMostGravity;
}

/// Whether a position is within the limits.
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
        // Cached contacts are dropped between steps, because results must not depend on what is loaded elsewhere.
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
    } catch (...) {  // counted below, like an invalid value
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
        // A body that recovers from the ground moves unaffected by contacts.
        const bool is_deep = starts[index].kind == StepStart::Kind::too_deep;
        mobility[index] = is_deep ? Mobility::driving : Mobility::moving;
    }
}

/// Finds touching bodies and wakes touched sleepers.
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
        // The body is parked for the whole step: undo its motion so far.
        static_cast<internal::BodyMotion&>(body) = before[index];
        ground_contacts[index].undo_step();
        if (vehicles[index] != nullptr) vehicles[index]->undo_step();
        states[index].condition = BodyCondition::parked;
        is_parked[index] = 1;
        return;
    }
    // A body that fell off the world must not re-enter below the ground. The ground's side has no surface that could
    // resolve the contact, so the horizontal velocity is removed and the body continues to fall.
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
