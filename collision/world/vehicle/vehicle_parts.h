// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/body_queries.h"
#include "world/solver/rigid_body.h"
#include "world/vehicle/drive_forces.h"

#include <terrane/collision/vehicle.h>

namespace terrane::internal {

/// Fails with invalid_argument if a field is out of range; the message names the field.
Result<void> check_vehicle(const VehicleSettings& settings);

/// The chassis box, the bodywork, and the wheels at the top of their travel as spheres.
Result<Compound> make_chassis_shape(const VehicleSettings& settings, const WheelSet& wheels);

/// The state of a vehicle beyond the body of its chassis.
class Vehicle {
public:
    explicit Vehicle(const VehicleSettings& settings) : wheels_(settings) {
        state_.wheels.resize(wheels_.count());
    }

    WheelSet& wheels() { return wheels_; }
    const VehicleSettings& settings() const { return wheels_.settings(); }
    const VehicleState& state() const { return state_; }
    const VehicleControls& controls() const { return controls_; }

    /// Mass properties of the chassis box: bodywork and wheels only collide.
    MassProperties mass() const {
        return make_mass_properties(Box{settings().chassis_half_extents}, settings().mass);
    }

    /// Index of the first wheel in the compound of make_chassis_shape(), after box and bodywork.
    std::uint32_t first_wheel_part() const {
        return static_cast<std::uint32_t>(1 + settings().bodywork.size());
    }

    /// Ignores controls that are not finite. Returns whether the controls changed.
    bool set_controls(const VehicleControls& controls);
    /// Whether the vehicle may fall asleep: brake on and no throttle.
    bool is_braked() const { return controls_.throttle == 0.0 && controls_.brake > 0.0; }

    void begin_step();
    /// Undoes the whole step.
    void undo_step();
    /// Casts the wheels from the top to the bottom of their travel. False if ground is not resident.
    /// @param body body of the chassis, excluded from the casts
    bool cast_wheels(const RigidBody& chassis, BodyId body, const QueryScene& scene);
    /// Ends a step of `dt` seconds: updates the state from the current contacts.
    /// @param touches whether the chassis touches something
    void end_step(const BodyState& chassis, const QueryScene& scene, bool touches, double dt);
    /// Copies the state of the chassis.
    void show(const BodyState& chassis) { state_.chassis = chassis; }
    /// Resets the vehicle and copies the state of its chassis, which was placed anew: the wheels hang.
    void place(const BodyState& chassis);
    /// Whether a wheel is in contact after the last cast.
    bool is_standing() const { return wheels_.in_contact(); }
    /// Whether a wheel stands on a given body after the last cast.
    bool stands_on(std::uint32_t body) const;
    /// Largest penetration depth of a wheel in the ground, metres.
    double wheel_depth(const Ground& ground) const;

    /// Serialises the fields that a copy with the same settings needs between two steps. See world/world_bytes.h. Call
    /// restore() after reading.
    template <class Stream, class AnyVehicle>
    static void list_fields(Stream& stream, AnyVehicle& vehicle);
    void restore() { update_commands(); }

private:
    void update_commands();

    WheelSet wheels_;
    VehicleControls controls_;
    VehicleState state_;
    std::vector<double> spins_before_;
    double rolled_over_time_ = 0.0;  // seconds of contact on its side or roof, up to the limit
};

template <class Stream, class AnyVehicle>
void Vehicle::list_fields(Stream& stream, AnyVehicle& vehicle) {
    auto& controls = vehicle.controls_;
    stream.number("throttle", controls.throttle, -1.0, 1.0);
    stream.number("brake", controls.brake, 0.0, 1.0);
    stream.number("steer", controls.steer, -1.0, 1.0);
    stream.number("rolled-over time", vehicle.rolled_over_time_, 0.0, 1.0);
    stream.flag("is_rolled_over", vehicle.state_.is_rolled_over);
    for (std::size_t i = 0; i < vehicle.wheels_.count(); ++i) {
        auto& contact = vehicle.wheels_.contacts()[i];
        auto& wheel = vehicle.state_.wheels[i];
        stream.length("spin", vehicle.wheels_.spins()[i]);
        stream.flag("touches", contact.touches);
        stream.word("body under a wheel", contact.body);
        stream.length("roll speed", contact.roll_speed);
        stream.length("side slip", contact.side_slip);
        stream.place("wheel centre", wheel.centre_world);
        stream.length("compression", wheel.compression);
        stream.length("spin", wheel.spin);
        stream.length("steer", wheel.steer);
        stream.flag("in_contact", wheel.in_contact);
        stream.word("body under a wheel", wheel.body.index);
        stream.word("its generation", wheel.body.generation);
        stream.place("wheel contact", wheel.point_world);
        stream.unit("wheel normal", wheel.normal);
        stream.length("load", wheel.load);
        stream.length("side slip", wheel.side_slip);
    }
}

}  // namespace terrane::internal
