// SPDX-License-Identifier: MIT
#include "world/world_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::RigidBody;

/// Largest rotation of one piece of move_to(), radians: within a piece the spin is constant.
constexpr double kMaxTurn = 0.5;

internal::MassProperties mass_of(const BodySettings& settings, const Shape& shape) {
    internal::MassProperties mass{.inverse_mass = 0.0};
    if (settings.type != BodyType::dynamic_body) return mass;
    mass = internal::make_mass_properties(shape, settings.mass);
    if (!settings.rotates) mass.inverse_inertia = mass.inertia = Eigen::Vector3d::Zero();
    return mass;
}

}  // namespace

World::State::State(const WorldSettings& world_settings)
    : settings(world_settings),
      island_solver(world_settings.broadphase, world_settings.collide_bodies,
                    world_settings.report_contacts,
                    world_settings.callbacks.may_collide
                        ? internal::PairFilter([this](std::uint32_t a, std::uint32_t b) {
                              return may_collide(a, b);
                          })
                        : internal::PairFilter{}),
      team(world_settings.worker_count) {}

void World::State::resize(std::size_t count) {
    states.resize(count);
    body_settings.resize(count);
    bodies.resize(count);
    gates.resize(count);
    mobility.resize(count, internal::Mobility::absent);
    sleep_groups.resize(count);
    records.resize(count);
    steps.resize(count);
}

BodyId World::State::add(const BodySettings& own_settings, internal::CentredShape&& shape,
                         const BodyPlacement& placement, const internal::MassProperties* mass) {
    const BodyId id = ids.acquire();
    resize(ids.slot_count());
    sleep_groups[id.index] = id.index;
    states[id.index].condition = BodyCondition::awake;
    set_up(id.index, own_settings, std::move(shape), mass);
    place(id.index, placement);
    return id;
}

BodyId World::State::add_vehicle(std::unique_ptr<internal::Vehicle> vehicle,
                                 const BodySettings& own_settings, Compound&& shape,
                                 const BodyPlacement& placement) {
    const internal::MassProperties mass = vehicle->mass();
    const BodyId id = add(own_settings, {std::move(shape), {}}, placement, &mass);
    bodies[id.index].first_wheel_part = vehicle->first_wheel_part();
    vehicle->place(states[id.index]);
    records[id.index].vehicle = std::move(vehicle);
    actuators.vehicles.insert(
        std::lower_bound(actuators.vehicles.begin(), actuators.vehicles.end(), id.index), id.index);
    return id;
}

BodyId World::State::add_character(const CharacterSettings& character,
                                   const BodySettings& own_settings,
                                   const BodyPlacement& placement) {
    const BodyId id = add(own_settings, {own_settings.shape, {}}, placement);
    records[id.index].character = std::make_unique<internal::Character>(character);
    records[id.index].character->place(states[id.index]);
    actuators.characters.insert(
        std::lower_bound(actuators.characters.begin(), actuators.characters.end(), id.index),
        id.index);
    return id;
}

void World::State::set_up(std::size_t index, const BodySettings& own_settings,
                          internal::CentredShape&& shape, const internal::MassProperties* mass) {
    BodyRecord& record = records[index];
    record.shape = std::move(shape.shape);
    record.body_from_centred = shape.body_from_centred;
    body_settings[index] = own_settings;
    const Shape& centred = record.shape;
    RigidBody& body = bodies[index];
    body.shape = &centred;
    body.radius = bounding_radius(centred);
    body.thickness = smallest_half_extent(centred);
    body.mass = mass != nullptr ? *mass : mass_of(own_settings, centred);
    body.friction = own_settings.friction;
    body.restitution = own_settings.restitution;
    body.tolerance = own_settings.contact_tolerance;
    body.filter = own_settings.filter;
    body.is_sensor = own_settings.is_sensor;
    body.first_wheel_part =
        record.vehicle != nullptr ? record.vehicle->first_wheel_part() : RigidBody::kNoPart;
}

void World::State::remove(BodyId body) {
    const std::size_t index = body.index;
    wake(index);
    forget_contacts(index);
    ids.release(body);
    if (records[index].vehicle != nullptr) std::erase(actuators.vehicles, body.index);
    if (records[index].character != nullptr) std::erase(actuators.characters, body.index);
    records[index] = {};
    bodies[index] = {};
    states[index] = {};
    states[index].condition = BodyCondition::removed;
    body_settings[index] = {};
    gates[index] = {};
    mobility[index] = internal::Mobility::absent;
    touch();
}

void World::State::change(std::size_t index, const BodySettings& own_settings,
                          internal::CentredShape&& shape, const BodyPlacement& placement) {
    wake(index);
    records[index].force = records[index].torque = Eigen::Vector3d::Zero();
    set_up(index, own_settings, std::move(shape), nullptr);
    place(index, placement);
}

void World::State::place(std::size_t index, const BodyPlacement& placement) {
    wake(index);
    forget_contacts(index);
    BodyRecord& record = records[index];
    Pose pose = internal::to_centred(placement.pose, record.body_from_centred);
    pose.rotation = orthonormalized(pose.rotation);
    static_cast<internal::BodyMotion&>(bodies[index]) = {
        .pose = pose, .velocity = {placement.velocity, placement.angular_velocity}};
    gates[index].reset();
    record.target.reset();
    record.is_placed_anew = true;
    static_cast<BodyPlacement&>(states[index]) = placement;
    states[index].condition =
        type(index) == BodyType::static_body ? BodyCondition::fixed : BodyCondition::awake;
    if (record.vehicle != nullptr) record.vehicle->place(states[index]);
    if (record.character != nullptr) record.character->place(states[index]);
    touch();
}

/// Removes the contacts of a body and wakes the bodies in contact with it.
void World::State::forget_contacts(std::size_t index) {
    island_solver.forget_contacts(static_cast<std::uint32_t>(index),
                                  [this](std::uint32_t other) { wake(other); });
    for (const std::uint32_t vehicle : actuators.vehicles) {
        if (records[vehicle].vehicle->stands_on(static_cast<std::uint32_t>(index))) wake(vehicle);
    }
}

void World::State::wake(std::size_t index) {
    if (is_asleep(index)) wake_group(sleep_groups[index]);
    records[index].quiet_time = 0.0;
    touch();
}

double World::State::reach(std::size_t index) const {
    const RigidBody& body = bodies[index];
    double travel = 0.0;
    const BodyRecord& record = records[index];
    if (record.vehicle != nullptr) travel = record.vehicle->settings().suspension_travel;
    if (record.character != nullptr) travel = record.character->settings().max_step;
    return body.radius + travel + body.tolerance;
}

void World::State::set_velocity(std::size_t index, const internal::Twist& velocity) {
    wake(index);
    bodies[index].velocity = velocity;
    records[index].target.reset();
    states[index].velocity = velocity.linear;
    states[index].angular_velocity = velocity.angular;
}

void World::State::publish(std::size_t index) {
    states[index].pose =
        internal::from_centred(bodies[index].pose, records[index].body_from_centred);
    states[index].velocity = bodies[index].velocity.linear;
    states[index].angular_velocity = bodies[index].velocity.angular;
}

BodyMove World::State::move_to(std::size_t index, const Pose& world_from_shape,
                               const Ground& ground) {
    wake(index);
    RigidBody& body = bodies[index];
    const Pose start = body.pose;
    Pose end = internal::to_centred(world_from_shape, records[index].body_from_centred);
    end.rotation = orthonormalized(end.rotation);
    const internal::Twist whole{end.translation - start.translation,
                                rotation_vector_between(start.rotation, end.rotation)};
    const double pieces = std::max(1.0, std::ceil(internal::length(whole.angular) / kMaxTurn));
    const internal::Twist piece{whole.linear / pieces, whole.angular / pieces};
    internal::GroundGate& gate = gates[index];
    gate.reset();
    BodyMove answer;
    for (double done = 0.0; done < pieces; done += 1.0) {
        const internal::MoveAnswer moved = gate.move(body, ground, piece);
        if (!moved.resident) {
            body.pose = start;
            gate.reset();
            return {.is_resident = false, .fraction = 0.0};
        }
        answer.fraction = (done + moved.fraction) / pieces;
        if (moved.fraction < 1.0) break;
    }
    gate.reset();
    island_solver.forget_bounds(index);
    publish(index);
    return answer;
}

}  // namespace terrane
