// SPDX-License-Identifier: MIT
#include "body_checks.h"
#include "wheeled_chassis.h"

#include <terrane/collision/truck.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane {
namespace {

constexpr std::size_t kWheelCount = 4;

internal::ChassisSettings chassis_of(const TruckSettings& s) {
    return {.half_extents = s.chassis_half_extents,
            .mass = s.mass,
            .wheel_radius = s.wheel_radius,
            .suspension_travel = s.suspension_travel,
            .suspension_hertz = s.suspension_hertz,
            .damping_ratio = s.damping_ratio,
            .tyre_friction = s.tyre_friction};
}

Result<void> check_settings(const TruckSettings& s) {
    if (auto ok = check_settings(chassis_of(s)); !ok) return ok;
    const internal::FieldRange fields[] = {
        {"wheelbase", s.wheelbase, 0.01, 1e3},
        {"track", s.track, 0.01, 1e3},
        {"max_drive_force", s.max_drive_force, 0.0, 1e12},
        {"max_brake_force", s.max_brake_force, 0.0, 1e12},
        {"max_steer", s.max_steer, 0.0, 1.5},
    };
    return internal::check_fields(fields);
}

std::array<Eigen::Vector3d, kWheelCount> wheels_of(const TruckSettings& s) {
    std::array<Eigen::Vector3d, kWheelCount> wheels;
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        wheels[i] = {(i < 2 ? 0.5 : -0.5) * s.wheelbase, (i % 2 == 0 ? 0.5 : -0.5) * s.track,
                     -0.5 * s.chassis_half_extents.z()};
    }
    return wheels;
}

}  // namespace

struct Truck::State {
    State(const TruckSettings& truck_settings, const BodyState& start)
        : settings(truck_settings),
          chassis(chassis_of(truck_settings), wheels_of(truck_settings), start) {}

    TruckSettings settings;
    TruckControls controls;
    internal::WheeledChassis chassis;
};

Truck::Truck(std::unique_ptr<State> state) : state_(std::move(state)) {}
Truck::Truck(Truck&&) noexcept = default;
Truck& Truck::operator=(Truck&&) noexcept = default;
Truck::~Truck() = default;

Result<Truck> Truck::create(const TruckSettings& settings, const Pose& start_world) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected<Error>(ok.error());
    BodyState start;
    start.pose = start_world;
    if (auto ok = internal::check_state(start); !ok) return tl::unexpected<Error>(ok.error());
    return Truck(std::make_unique<State>(settings, start));
}

const BodyState& Truck::chassis() const { return state_->chassis.state(); }
const TruckSettings& Truck::settings() const { return state_->settings; }
std::span<const WheelState> Truck::wheels() const { return state_->chassis.wheels(); }
BodyNeed Truck::need() const { return state_->chassis.need(); }

StepReport Truck::step(const Ground& ground, const TruckControls& controls, double dt) {
    State& state = *state_;
    if (std::isfinite(controls.throttle) && std::isfinite(controls.brake) &&
        std::isfinite(controls.steer)) {
        state.controls = {std::clamp(controls.throttle, -1.0, 1.0),
                          std::clamp(controls.brake, 0.0, 1.0),
                          std::clamp(controls.steer, -1.0, 1.0)};
    }
    std::array<internal::WheelCommand, kWheelCount> commands;
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        commands[i] = {state.controls.throttle * state.settings.max_drive_force / kWheelCount,
                       state.controls.brake * state.settings.max_brake_force / kWheelCount,
                       i < 2 ? state.controls.steer * state.settings.max_steer : 0.0};
    }
    return state.chassis.step(ground, commands, dt);
}

}  // namespace terrane
