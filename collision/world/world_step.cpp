// SPDX-License-Identifier: MIT
//
// A step of the world, from step() down; then actuators of vehicles and characters; then sleep.
//
// Sources:    Catto. Solver2D. 2024 (contact detection once per step, substeps on these contacts).
//             Mirtich. Timewarp and impulse-based simulation. 2000 (islands).
// Deviations: islands are solved with their ground contacts on scratch poses; then each body's net displacement is
//             applied separately against its offset surface, so that the ground constraint holds for any solution of
//             the islands.
#include "world/solver/body_checks.h"
#include "world/world_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::GroundGate;
using internal::Mobility;
using internal::RigidBody;

/// Substeps per detection of contacts.
constexpr double kSubstepsPerCollisionStep = 2.0;
constexpr std::size_t kBlock = 16;      // bodies per block of a thread
constexpr double kMostGravity = 1e4;    // m/s^2
constexpr double kSameDuration = 1e-9;  // relative tolerance of target times

bool is_valid_gravity(const Eigen::Vector3d& gravity) {
    return std::abs(gravity.x()) <= kMostGravity && std::abs(gravity.y()) <= kMostGravity &&
           std::abs(gravity.z()) <= kMostGravity;
}

/// Number of equal substeps of a step.
double count_substeps(double dt, double max_substep) {
    constexpr double kSlack = 1e-9;  // rounding: 2.0000001 counts as 2
    return std::max(1.0, std::ceil(dt / max_substep - kSlack));
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
    if (idle_report) return *idle_report;
    touch();
    begin_step();
    const double substep_count = count_substeps(dt, settings.max_substep);
    const double substep = dt / substep_count;
    for (double done = 0.0; done < substep_count; done += kSubstepsPerCollisionStep) {
        const double count = std::min(kSubstepsPerCollisionStep, substep_count - done);
        run_collision_step(ground,
                           {.duration = count * substep, .substep_count = static_cast<int>(count)});
    }

    if (settings.measure_depth) {
        team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
            const bool is_measured =
                is_stepped(i) || (ids.is_used(i) && type(i) == BodyType::kinematic_body);
            if (is_measured) steps[i].lift = internal::greatest_lift(bodies[i], ground);
        });
    }
    StepReport report;
    bool is_moving = false;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (mobility[i] == Mobility::absent) continue;
        if (type(i) == BodyType::dynamic_body) finish_dynamic(i, ground, report);
        if (type(i) == BodyType::kinematic_body) finish_kinematic(i, dt, report);
        records[i].is_placed_anew = false;
    }
    report.touching_pairs = island_solver.touching_pair_count();
    report.skipped_pairs = island_solver.skipped_pair_count();
    report.failed_callbacks = failed_callbacks;
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t i = 0; i < islands.count(); ++i) {
        if (!islands.links(i).empty()) ++report.islands;
    }
    finish_actuators(ground, dt, report);
    if (settings.report_contacts) {
        contacts.end_step(island_solver, {ids, bodies, gates, mobility});
    }
    if (settings.allow_sleep) fall_asleep(dt);
    for (std::size_t i = 0; i < bodies.size() && !is_moving; ++i) {
        is_moving = (type(i) == BodyType::dynamic_body && ids.is_used(i) && !is_asleep(i)) ||
                    mobility[i] == Mobility::prescribed;
    }
    if (!is_moving) {
        ground_before.reset();
        idle_report = StepReport{.asleep = report.awake + report.asleep,
                                 .kinematic_in_ground = report.kinematic_in_ground};
    }
    return report;
}

void World::State::begin_step() {
    failed_callbacks = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        steps[i].is_parked = false;
        mobility[i] = ids.is_used(i) ? Mobility::fixed : Mobility::absent;
        if (!is_stepped(i)) continue;
        const RigidBody& body = bodies[i];
        enter_step(i, gravity_of(body) + records[i].force * body.mass.inverse_mass);
    }
}

/// Begins the step of an awake body.
void World::State::enter_step(std::size_t index, const Eigen::Vector3d& acceleration) {
    RigidBody& body = bodies[index];
    BodyRecord& record = records[index];
    gates[index].begin_step();
    steps[index].before = body;
    steps[index].total = {};
    body.acceleration = acceleration;
    if (record.vehicle != nullptr) record.vehicle->begin_step();
    if (record.character != nullptr) record.character->begin_step(acceleration);
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

void World::State::run_collision_step(const Ground& ground, const internal::StepSpan& span) {
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) {
        if (is_stepped(i)) begin_body(i, ground, span);
    });
    begin_actuators(ground, span.duration);
    find_islands(ground, span);
    choose_actuators();
    island_solver.step(bodies, gates, {actuators.wheels, actuators.feet}, span, team);
    if (settings.report_contacts) contacts.add_impulses(island_solver, mobility);
    team.run_blocks(bodies.size(), kBlock, [&](std::size_t i) { end_body(i, ground, span); });
    end_actuators(ground, span.duration);
    ground_before = ground;
}

void World::State::begin_body(std::size_t index, const Ground& ground,
                              const internal::StepSpan& span) {
    RigidBody& body = bodies[index];
    const Eigen::Vector3d& torque = records[index].torque;
    if (!torque.isZero(0.0)) {
        body.velocity.angular +=
            internal::apply_tensor(body.pose.rotation, body.mass.inverse_inertia, torque) *
            span.duration;
    }
    gates[index].begin(body, ground, ground_before ? &*ground_before : nullptr, span);
}

void World::State::set_mobility(std::size_t index) {
    if (mobility[index] == Mobility::absent) return;
    if (type(index) != BodyType::dynamic_body) {
        mobility[index] = is_prescribed(index) ? Mobility::prescribed : Mobility::fixed;
    } else if (is_asleep(index)) {
        mobility[index] = Mobility::asleep;
    } else if (!is_stepped(index) || gates[index].state() == GroundGate::State::not_resident) {
        mobility[index] = Mobility::fixed;
    } else {
        // A body that recovers from the ground moves unaffected by contacts.
        const bool is_deep = gates[index].state() == GroundGate::State::too_deep;
        mobility[index] = is_deep ? Mobility::prescribed : Mobility::moving;
    }
}

/// Finds touching bodies and wakes touched sleepers.
void World::State::find_islands(const Ground& ground, const internal::StepSpan& span) {
    for (std::size_t i = 0; i < bodies.size(); ++i) set_mobility(i);
    island_solver.find(bodies, sleep_groups, actuators.wheel_links, mobility, span, team);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || mobility[i] != Mobility::moving) continue;
        states[i].condition = BodyCondition::awake;
        records[i].quiet_time = 0.0;
        enter_step(i, gravity_of(bodies[i]));
        begin_body(i, ground, span);
    }
}

void World::State::end_body(std::size_t index, const Ground& ground,
                            const internal::StepSpan& span) {
    RigidBody& body = bodies[index];
    if (mobility[index] == Mobility::prescribed && type(index) == BodyType::kinematic_body) {
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
    const bool is_open = gates[index].state() == internal::GroundGate::State::open;
    internal::GateAnswer answer = gates[index].end(body, ground, span);
    if (is_open && island_solver.has_struck_ground(index)) ++answer.impacts;
    steps[index].total.add(answer);
    if (!answer.resident || !is_in_reach(body.pose.translation)) {
        // The body is parked for the whole step: undo its motion so far.
        static_cast<internal::BodyMotion&>(body) = steps[index].before;
        gates[index].undo_step();
        if (records[index].vehicle != nullptr) records[index].vehicle->undo_step();
        states[index].condition = BodyCondition::parked;
        steps[index].is_parked = true;
    }
}

void World::State::finish_kinematic(std::size_t index, double dt, StepReport& report) {
    RigidBody& body = bodies[index];
    if (std::optional<internal::KinematicTarget>& target = records[index].target; target) {
        const bool reaches = std::abs(dt - target->time_left) <= kSameDuration * dt;
        if (reaches) body.pose = target->pose;
        target->time_left -= dt;
        if (reaches || target->time_left <= 0.0) {
            body.velocity = {};
            target.reset();
        }
    }
    if (mobility[index] == Mobility::prescribed) publish(index);
    const bool is_in_ground =
        settings.measure_depth && !body.is_sensor && steps[index].lift > body.tolerance;
    if (is_in_ground) ++report.kinematic_in_ground;
}

void World::State::finish_dynamic(std::size_t index, const Ground& ground, StepReport& report) {
    records[index].force.setZero();
    records[index].torque.setZero();
    BodyState& state = states[index];
    const BodyStep& taken = steps[index];
    if (taken.is_parked) {
        ++report.parked;
        return;
    }
    if (is_asleep(index)) {
        ++report.asleep;
        return;
    }
    const RigidBody& body = bodies[index];
    const internal::GateAnswer& total = taken.total;
    report.impacts += total.impacts;
    if (settings.report_contacts) {
        contacts.add_ground_impulse(static_cast<std::uint32_t>(index), total.impulse);
    }
    if (taken.before.is_fresh && body.started_deep) ++report.placed_deep;
    if (!total.touches && internal::is_outside(ground, body.pose.translation)) {
        state.condition = BodyCondition::left_world;
        ++report.left_world;
    } else {
        state.condition = BodyCondition::awake;
        ++report.awake;
        report.simulated_time += total.simulated_time;
        report.lost_time += total.lost_time;
        if (settings.measure_depth) {
            const double depth = internal::deepest(body, ground, taken.lift,
                                                   std::min(report.max_depth_m, body.tolerance));
            report.max_depth_m = std::max(report.max_depth_m, depth);
            if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
        }
    }
    publish(index);
}

// Actuators of vehicles and characters. Wheels are cast against bodies and ground once per collision step. In the
// substeps of islands, wheels exert forces and feet drive contacts.

void World::State::begin_actuators(const Ground& ground, double duration) {
    if (actuators.vehicles.empty() && actuators.characters.empty()) return;
    touch();
    const internal::QueryScene now = scene(ground);
    cast_wheels(now);
    team.run_blocks(actuators.characters.size(), 1, [&](std::size_t i) {
        const std::uint32_t slot = actuators.characters[i];
        if (!is_stepped(slot) || gates[slot].state() != GroundGate::State::open) return;
        records[slot].character->begin_collision_step(bodies[slot], {now, bodies, ids.id(slot)},
                                                      duration);
    });
}

/// Casts the wheels of all vehicles, including sleeping ones: a body that moves under a wheel wakes its vehicle.
void World::State::cast_wheels(const internal::QueryScene& now) {
    team.run_blocks(actuators.vehicles.size(), 1, [&](std::size_t i) {
        const std::uint32_t slot = actuators.vehicles[i];
        const bool is_moving = is_stepped(slot) && gates[slot].state() == GroundGate::State::open;
        if (!is_moving && !is_asleep(slot)) return;
        internal::Vehicle& vehicle = *records[slot].vehicle;
        if (!vehicle.cast_wheels(bodies[slot], ids.id(slot), now)) {
            gates[slot].set_not_resident();
            return;
        }
        vehicle.wheels().begin_collision_step(bodies[slot].pose, bodies);
    });
    std::vector<BodyPair>& links = actuators.wheel_links;
    links.clear();
    for (const std::uint32_t slot : actuators.vehicles) {
        for (const internal::WheelContact& contact : records[slot].vehicle->wheels().contacts()) {
            if (!contact.touches || contact.body == internal::kNone) continue;
            const BodyPair link{std::min(slot, contact.body), std::max(slot, contact.body)};
            if (links.empty() || !(links.back() == link)) links.push_back(link);
        }
    }
}

/// Selects the actuators of moving bodies.
void World::State::choose_actuators() {
    actuators.wheels.clear();
    actuators.feet.clear();
    if (!actuators.vehicles.empty()) actuators.wheels.resize(bodies.size(), nullptr);
    if (!actuators.characters.empty()) actuators.feet.resize(bodies.size(), nullptr);
    for (const std::uint32_t slot : actuators.vehicles) {
        if (mobility[slot] == Mobility::moving)
            actuators.wheels[slot] = &records[slot].vehicle->wheels();
    }
    for (const std::uint32_t slot : actuators.characters) {
        if (mobility[slot] == Mobility::moving)
            actuators.feet[slot] = &records[slot].character->feet();
    }
}

/// Moves stopped characters onto steps, sequentially, so that each sees the positions of the others.
void World::State::end_actuators(const Ground& ground, double duration) {
    for (const std::uint32_t slot : actuators.characters) {
        internal::Character& character = *records[slot].character;
        const WorldPos& start = gates[slot].start().translation;
        if (!is_stepped(slot) || mobility[slot] != Mobility::moving ||
            !character.is_stopped(bodies[slot], start, duration)) {
            continue;
        }
        touch();
        const internal::QueryScene now = scene(ground);
        character.end_collision_step(bodies[slot], {now, bodies, ids.id(slot)}, start, duration);
    }
}

void World::State::show_to_actuators(std::size_t index) {
    const BodyRecord& record = records[index];
    if (record.vehicle != nullptr) record.vehicle->show(states[index]);
    if (record.character != nullptr) record.character->show(states[index]);
}

void World::State::finish_actuators(const Ground& ground, double dt, StepReport& report) {
    for (const std::uint32_t slot : actuators.characters)
        records[slot].character->show(states[slot]);
    if (actuators.vehicles.empty()) return;
    touch();
    const internal::QueryScene now = scene(ground);
    for (const std::uint32_t slot : actuators.vehicles) {
        internal::Vehicle& vehicle = *records[slot].vehicle;
        if (!is_stepped(slot)) {
            vehicle.show(states[slot]);
            continue;
        }
        // If ground under a wheel is not resident, the contacts of the last collision step remain.
        vehicle.cast_wheels(bodies[slot], ids.id(slot), now);
        vehicle.end_step(states[slot], now, steps[slot].total.touches, dt);
        if (!settings.measure_depth) continue;
        const double depth = vehicle.wheel_depth(ground);
        report.max_depth_m = std::max(report.max_depth_m, depth);
        const internal::RigidBody& body = bodies[slot];
        if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
    }
}

// Sleeping and waking of islands.

namespace {

constexpr double kSleepSpeed = 0.03;  // metres per second, of the fastest point
constexpr double kSleepDelay = 0.5;   // seconds

}  // namespace

void World::State::wake_group(std::uint32_t group) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!is_asleep(i) || sleep_groups[i] != group) continue;
        states[i].condition = BodyCondition::awake;
        records[i].quiet_time = 0.0;
        show_to_actuators(i);
    }
}

/// Puts islands to sleep if all their bodies have been slow and supported for kSleepDelay. An island touched by a
/// prescribed body stays awake.
void World::State::fall_asleep(double dt) {
    const internal::Islands& islands = island_solver.islands();
    for (std::size_t island = 0; island < islands.count(); ++island) {
        const std::span<const std::uint32_t> members = islands.bodies(island);
        const bool has_links = !islands.links(island).empty();
        bool is_quiet = !island_solver.is_driven(island);
        for (const std::uint32_t body : members) {
            if (states[body].condition == BodyCondition::parked) {  // no time passes for it
                is_quiet = is_quiet && records[body].quiet_time >= kSleepDelay;
                continue;
            }
            const internal::Vehicle* const vehicle = records[body].vehicle.get();
            const bool is_held = has_links || steps[body].total.touches ||
                                 (vehicle != nullptr && vehicle->is_standing());
            const internal::Character* const character = records[body].character.get();
            const bool may_sleep = (vehicle == nullptr || vehicle->is_braked()) &&
                                   (character == nullptr || character->is_idle());
            // Separation of overlaps moves bodies without velocity.
            const double moved =
                internal::greatest_move(bodies[body], steps[body].before.pose, bodies[body].pose);
            const bool is_slow =
                states[body].condition == BodyCondition::awake && is_held && may_sleep &&
                internal::greatest_speed(bodies[body]) < kSleepSpeed && moved < kSleepSpeed * dt;
            records[body].quiet_time = is_slow ? records[body].quiet_time + dt : 0.0;
            is_quiet = is_quiet && records[body].quiet_time >= kSleepDelay;
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
    gates[index].forget_proof();
    show_to_actuators(index);
}

}  // namespace terrane
