// SPDX-License-Identifier: MIT
// The wheels of a world's vehicles: they are cast once a collision step through the bodies and the ground, and exert
// their forces in the substeps of the islands.
#include "world/world_state.h"

#include <algorithm>

namespace terrane {

using internal::Mobility;
using internal::StepStart;

/// Casts the wheels of the vehicles, of sleeping ones too: a body that moves under a wheel wakes its vehicle.
void World::State::cast_wheels(const Ground& ground) {
    touch();
    const internal::QueryScene now = scene(ground);
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

/// The wheels that exert forces are those of moving vehicles.
void World::State::choose_wheels() {
    wheel_sets.clear();
    if (vehicle_slots.empty()) return;
    wheel_sets.resize(bodies.size(), nullptr);
    for (const std::uint32_t slot : vehicle_slots) {
        if (mobility[slot] == Mobility::moving) wheel_sets[slot] = &vehicles[slot]->wheels();
    }
}

void World::State::finish_vehicles(const Ground& ground, double dt, StepReport& report) {
    touch();
    const internal::QueryScene now = scene(ground);
    for (const std::uint32_t slot : vehicle_slots) {
        internal::Vehicle& vehicle = *vehicles[slot];
        if (!is_stepped(slot)) {
            vehicle.set_condition(states[slot].condition);
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
