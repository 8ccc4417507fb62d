// SPDX-License-Identifier: MIT
//
// Sources of the default settings:
//   Wong. Theory of ground vehicles. 2008, chapters 1 and 3: tyres on dry asphalt, peak friction 0.8 to 0.9 and 0.75
//     sliding; rolling resistance 0.012 to 0.015 on hard roads.
//   NHTSA. Rating system for rollover resistance. Federal Register 66 FR 3388, 2001: static stability factor track / (2
//     height of the centre of mass); light trucks are at 1.0 to 1.3. A vehicle slides before it rolls where its tyres'
//     friction is below that, less what the suspension's roll takes (here 0.1).
//   Gillespie. Fundamentals of vehicle dynamics. 1992, chapters 4 and 5: bounce frequencies of 1 to 2 Hz, damping
//     ratios of 0.2 to 0.4; drag coefficients of pickups and utility vehicles about 0.45, over 3 m^2.
// The drive force is limited by the tyres' grip on a slope, as for trucks in low gear; power and drag area give a top
// speed of 48 m/s.
// Deviations: power is given at the wheels, and constant over the speed, as with a gearbox of many ratios. The roll
//     axis lies on the ground: there is no suspension geometry.
#include "bodies/body_checks.h"
#include "bodies/step/body_step.h"
#include "vehicles/wheeled_chassis.h"

#include <terrane/collision/truck.h>

#include <algorithm>
#include <array>
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
            .tyre_friction = s.tyre_friction,
            .max_drive_power = s.max_drive_power,
            .rolling_resistance = s.rolling_resistance,
            .drag_area = s.drag_area};
}

Result<void> check_settings(const TruckSettings& s) {
    if (auto ok = check_settings(chassis_of(s)); !ok) return ok;
    const internal::FieldRange fields[] = {
        {"centre_of_mass_height", s.centre_of_mass_height, s.chassis_half_extents.z(), 1e3},
        {"wheelbase", s.wheelbase, 0.01, 1e3},
        {"track", s.track, 0.01, 1e3},
        {"max_drive_force", s.max_drive_force, 0.0, 1e12},
        {"max_brake_force", s.max_brake_force, 0.0, 1e12},
        {"max_steer", s.max_steer, 0.0, 1.5},
    };
    return internal::check_fields(fields);
}

/// Centres of the wheels at the top of their travel.
std::array<Eigen::Vector3d, kWheelCount> wheels_of(const TruckSettings& s) {
    constexpr double kTwoPi = 6.283185307179586;
    const double omega = kTwoPi * s.suspension_hertz;
    const double sag = std::min(internal::kGravity / (omega * omega), s.suspension_travel);
    const double top = s.wheel_radius - s.centre_of_mass_height + s.suspension_travel - sag;
    std::array<Eigen::Vector3d, kWheelCount> wheels;
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        wheels[i] = {(i < 2 ? 0.5 : -0.5) * s.wheelbase, (i % 2 == 0 ? 0.5 : -0.5) * s.track, top};
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
bool Truck::is_rolled_over() const { return state_->chassis.is_rolled_over(); }
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
        commands[i] = {
            .drive_force = state.controls.throttle * state.settings.max_drive_force / kWheelCount,
            .brake_force = state.controls.brake * state.settings.max_brake_force / kWheelCount,
            .steer = i < 2 ? state.controls.steer * state.settings.max_steer : 0.0};
    }
    return state.chassis.step(ground, commands, dt);
}

}  // namespace terrane
