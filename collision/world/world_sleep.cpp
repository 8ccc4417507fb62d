// SPDX-License-Identifier: MIT
// Islands that fall asleep and wake up.
#include "world/world_state.h"

namespace terrane {
namespace {

constexpr double kSleepSpeed = 0.03;  // metres a second, of the fastest point
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

/// Puts islands to sleep whose bodies have been slow and supported for kSleepDelay. An island that a driving body
/// touches stays awake.
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
            // Separation of overlaps has no velocity.
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

}  // namespace terrane
