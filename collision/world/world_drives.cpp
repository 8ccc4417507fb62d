// SPDX-License-Identifier: MIT
// What drives a world's vehicles and characters. Wheels are cast once a collision step through the bodies and the
// ground, and exert their forces in the substeps of the islands; feet drive contacts there.
#include "world/world_state.h"

#include <algorithm>

namespace terrane {

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

/// Casts the wheels of the vehicles, of sleeping ones too: a body that moves under a wheel wakes its vehicle.
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

/// Those of moving bodies act.
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

/// Steps of stopped characters, one after the other: each sees where the others are.
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
        // Where ground under a wheel is not resident, the contacts of the last collision step stand.
        vehicle.cast_wheels(bodies[slot], ids.id(slot), now);
        vehicle.end_step(states[slot], now, totals[slot].touches, dt);
        if (!settings.measure_depth) continue;
        const double depth = vehicle.wheel_depth(ground);
        report.max_depth_m = std::max(report.max_depth_m, depth);
        const internal::RigidBody& body = bodies[slot];
        if (depth > body.tolerance && !body.started_deep) ++report.too_deep;
    }
}

}  // namespace terrane
