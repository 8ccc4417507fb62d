// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/truck.h>

#include <memory>
#include <span>

namespace terrane {

/// A skid-steered vehicle on two tracks. The defaults are like an armoured personnel carrier of 12 t; its centre of
/// mass is 0.84 m above flat ground at rest.
///
/// Body frame: x forward, y left, z up, origin at the centre of the chassis box, which is also the centre of mass. The
/// inertia is that of the box with uniform density. The wheels' centres at the top of their travel are
/// chassis_half_extents.z / 2 below the origin.
struct TrackedSettings {
    /// Of the chassis, metres; x is along the vehicle.
    Eigen::Vector3d chassis_half_extents =
        Eigen::Vector3d(2.6, 1.1, 0.5);  ///< of the box that collides, metres, each 0.01 to 1000
    double mass = 12e3;                  ///< kilograms, tracks included, 1e-3 to 1e9
    int wheels_a_side = 5;               ///< road wheels, 2 to 16
    double wheel_radius = 0.4;           ///< metres, 0.01 to 100
    double track_length = 3.6;  ///< from the first to the last wheel's centre, metres, 0.01 to 1000
    double track = 2.2;         ///< between the middles of the tracks, metres, 0.01 to 1000
    double suspension_travel = 0.3;  ///< from hanging to fully compressed, metres, 0.001 to 100
    double suspension_hertz = 1.5;   ///< natural frequency of the body's bounce, 0.1 to 10
    double damping_ratio = 0.6;      ///< of the body's bounce, 1 is critical, 0 to 10
    double track_friction = 0.9;     ///< Coulomb, along the tracks, 0 to 100
    double side_grip = 0.6;          ///< friction across the tracks over that along them, 0.01 to 1
    double max_drive_force = 90e3;   ///< of both tracks at low speed, newtons, 0 to 1e12
    double max_drive_power = 110e3;  ///< at both tracks, watts, 0 to 1e12
    double max_brake_force = 100e3;  ///< of both tracks, newtons, 0 to 1e12
    double rolling_resistance = 0.04;  ///< force against the roll over the load, 0 to 1
    double drag_area = 6.0;            ///< drag coefficient times frontal area, m^2, 0 to 1e4
};

/// Each is clamped to its range.
struct TrackedControls {
    /// -1 (backward) to 1 (forward): share of max_drive_force, limited by max_drive_power at the present speed. Against
    /// the motion it brakes.
    double throttle = 0.0;
    double brake = 0.0;  ///< 0 to 1: share of max_brake_force
    /// -1 (right) to 1 (left): subtracted from the inner track's throttle, added to the outer's.
    double turn = 0.0;
};

/// A box chassis on two rows of wheels. The wheels of a track have the same drive force and slide sideways as the
/// vehicle turns. Air drag is that of Truck. With the defaults full throttle on flat ground reaches 18 m/s.
///
/// Threads: one at a time.
class Tracked {
public:
    /// @param start_world pose of the chassis
    ///
    /// Fails: invalid_argument, naming the field, for anything not finite or out of range
    static Result<Tracked> create(const TrackedSettings& settings, const Pose& start_world);
    Tracked(Tracked&&) noexcept;
    Tracked& operator=(Tracked&&) noexcept;
    ~Tracked();

    /// Advances by dt seconds, 0 < dt <= 1. Controls that are not finite are ignored: the last valid ones are used.
    StepReport step(const Ground& ground, const TrackedControls& controls, double dt);

    /// The chassis, and the settings given to create().
    const BodyState& chassis() const;
    const TrackedSettings& settings() const;
    /// From front to rear, left before right.
    std::span<const WheelState> wheels() const;
    /// See Truck::is_rolled_over().
    bool is_rolled_over() const;
    BodyNeed need() const;

private:
    struct State;
    explicit Tracked(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
