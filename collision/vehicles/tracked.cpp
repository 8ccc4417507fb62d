// SPDX-License-Identifier: MIT
//
// Sources:   Wong. Theory of ground vehicles. 2008, section 6.1 (skid-steering on a rigid ground: Coulomb friction
//            across the tracks is what turning has to overcome).
//            The same, chapters 3 and 4: rolling resistance of tracks on firm ground, and drag. The default power is
//            that at the tracks of an M113 of 12 t and 158 kW, which reaches 18 m/s, at an efficiency of 70 %.
// Deviation: a track is a row of wheels of equal force; its belt has no mass and no tension.
#include "bodies/body_checks.h"
#include "vehicles/wheeled_chassis.h"

#include <terrane/collision/tracked.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane {
namespace {

internal::ChassisSettings chassis_of(const TrackedSettings& s) {
    return {.half_extents = s.chassis_half_extents,
            .mass = s.mass,
            .wheel_radius = s.wheel_radius,
            .suspension_travel = s.suspension_travel,
            .suspension_hertz = s.suspension_hertz,
            .damping_ratio = s.damping_ratio,
            .tyre_friction = s.track_friction,
            .side_grip = s.side_grip,
            .rolls_first = true,
            .max_drive_power = s.max_drive_power,
            .rolling_resistance = s.rolling_resistance,
            .drag_area = s.drag_area};
}

Result<void> check_settings(const TrackedSettings& s) {
    const internal::FieldRange fields[] = {
        {"wheels_a_side", static_cast<double>(s.wheels_a_side), 2.0, 16.0},
        {"track_length", s.track_length, 0.01, 1e3},
        {"track", s.track, 0.01, 1e3},
        {"track_friction", s.track_friction, 0.0, 100.0},
        {"max_drive_force", s.max_drive_force, 0.0, 1e12},
        {"max_brake_force", s.max_brake_force, 0.0, 1e12},
    };
    if (auto ok = internal::check_fields(fields); !ok) return ok;
    return check_settings(chassis_of(s));
}

std::vector<Eigen::Vector3d> wheels_of(const TrackedSettings& s) {
    std::vector<Eigen::Vector3d> wheels;
    for (int i = 0; i < s.wheels_a_side; ++i) {
        const double x = s.track_length * (0.5 - i / (s.wheels_a_side - 1.0));
        for (const double side : {0.5, -0.5}) {
            wheels.emplace_back(x, side * s.track, -0.5 * s.chassis_half_extents.z());
        }
    }
    return wheels;
}

}  // namespace

struct Tracked::State {
    State(const TrackedSettings& tracked_settings, const BodyState& start)
        : settings(tracked_settings),
          chassis(chassis_of(tracked_settings), wheels_of(tracked_settings), start),
          commands(chassis.wheels().size()) {}

    TrackedSettings settings;
    TrackedControls controls;
    internal::WheeledChassis chassis;
    std::vector<internal::WheelCommand> commands;
};

Tracked::Tracked(std::unique_ptr<State> state) : state_(std::move(state)) {}
Tracked::Tracked(Tracked&&) noexcept = default;
Tracked& Tracked::operator=(Tracked&&) noexcept = default;
Tracked::~Tracked() = default;

Result<Tracked> Tracked::create(const TrackedSettings& settings, const Pose& start_world) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected<Error>(ok.error());
    BodyState start;
    start.pose = start_world;
    if (auto ok = internal::check_state(start); !ok) return tl::unexpected<Error>(ok.error());
    return Tracked(std::make_unique<State>(settings, start));
}

const BodyState& Tracked::chassis() const { return state_->chassis.state(); }
const TrackedSettings& Tracked::settings() const { return state_->settings; }
std::span<const WheelState> Tracked::wheels() const { return state_->chassis.wheels(); }
bool Tracked::is_rolled_over() const { return state_->chassis.is_rolled_over(); }
BodyNeed Tracked::need() const { return state_->chassis.need(); }

StepReport Tracked::step(const Ground& ground, const TrackedControls& controls, double dt) {
    State& state = *state_;
    if (std::isfinite(controls.throttle) && std::isfinite(controls.brake) &&
        std::isfinite(controls.turn)) {
        state.controls = {std::clamp(controls.throttle, -1.0, 1.0),
                          std::clamp(controls.brake, 0.0, 1.0),
                          std::clamp(controls.turn, -1.0, 1.0)};
    }
    const TrackedControls& now = state.controls;
    const auto wheel_count = static_cast<double>(state.commands.size());
    const double left = std::clamp(now.throttle - now.turn, -1.0, 1.0);
    const double right = std::clamp(now.throttle + now.turn, -1.0, 1.0);
    const double force = state.settings.max_drive_force / wheel_count;
    for (std::size_t i = 0; i < state.commands.size(); ++i) {
        internal::WheelCommand& command = state.commands[i];
        command.drive_force = 0.5 * (right + left) * force;
        command.turn_force = (i % 2 == 0 ? 0.5 : -0.5) * (left - right) * force;
        command.brake_force = now.brake * state.settings.max_brake_force / wheel_count;
    }
    return state.chassis.step(ground, state.commands, dt);
}

}  // namespace terrane
