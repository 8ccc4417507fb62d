// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"
#include "bodies/wheels/wheel_set.h"
#include "world/queries/world_queries.h"

#include <terrane/collision/vehicle.h>

namespace terrane::internal {

/// Fails with invalid_argument, naming the field, where one is out of range.
Result<void> check_vehicle(const VehicleSettings& settings);

/// The chassis box, the bodywork, and the wheels at the top of their travel as spheres.
Result<Compound> make_chassis_shape(const VehicleSettings& settings, const WheelSet& wheels);

/// A vehicle of a world, beside the body that its chassis is.
class Vehicle {
public:
    explicit Vehicle(const VehicleSettings& settings) : wheels_(settings) {
        state_.wheels.resize(wheels_.count());
    }

    WheelSet& wheels() { return wheels_; }
    const VehicleSettings& settings() const { return wheels_.settings(); }
    const VehicleState& state() const { return state_; }
    const VehicleControls& controls() const { return controls_; }

    /// Ignored where a value is not finite. Returns whether they change.
    bool set_controls(const VehicleControls& controls);
    /// Whether it may fall asleep: with the brake on, and no throttle.
    bool is_braked() const { return controls_.throttle == 0.0 && controls_.brake > 0.0; }

    void begin_step();
    /// Undoes the step, of which nothing remains.
    void undo_step();
    /// Casts the wheels from the top of their travel to its end. False where ground is not resident.
    /// @param body of the chassis; the wheels do not meet it
    bool cast_wheels(const RigidBody& chassis, BodyId body, const QueryScene& scene);
    /// Ends a step of `dt` seconds: makes the state of the present contacts.
    /// @param touches the chassis touches something
    void end_step(const BodyState& chassis, const QueryScene& scene, bool touches, double dt);
    /// Takes over the state of the chassis.
    void show(const BodyState& chassis) { state_.chassis = chassis; }
    /// The same where the chassis has been placed anew: the wheels hang.
    void place(const BodyState& chassis);
    /// Whether a wheel is in contact, as of the last cast.
    bool is_standing() const { return wheels_.in_contact(); }
    /// Whether a wheel stands on a body, as of the last cast.
    bool stands_on(std::uint32_t body) const;
    /// Largest penetration depth of a wheel in the ground, metres.
    double wheel_depth(const Ground& ground) const;

private:
    void update_commands();

    WheelSet wheels_;
    VehicleControls controls_;
    VehicleState state_;
    std::vector<double> spins_before_;
    double rolled_over_time_ = 0.0;  // seconds of contact on its side or roof, up to the limit
};

}  // namespace terrane::internal
