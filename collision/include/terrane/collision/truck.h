// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <memory>
#include <span>

namespace terrane {

/// A truck on four wheels. The defaults are a light off-road truck that slides on flat ground before it rolls over: its
/// static stability factor, track / (2 centre_of_mass_height), is 1.2, and its tyre friction 0.8.
///
/// Body frame: x forward, y left, z up, origin at the centre of the chassis box, which is also the centre of mass. The
/// inertia is that of the box with uniform density.
struct TruckSettings {
    /// Of the chassis, metres; x is along the vehicle.
    Eigen::Vector3d chassis_half_extents =
        Eigen::Vector3d(2.3, 0.9, 0.4);  ///< of the box that collides, metres, each 0.01 to 1000
    double mass = 3500.0;                ///< kilograms, wheels included, 1e-3 to 1e9
    /// Above flat ground at rest, metres, chassis_half_extents.z to 1000. Determines the height of the wheels.
    double centre_of_mass_height = 0.75;
    double wheel_radius = 0.42;         ///< metres, 0.01 to 100
    double wheelbase = 3.2;             ///< between the axles, metres, 0.01 to 1000
    double track = 1.8;                 ///< between the wheels of an axle, metres, 0.01 to 1000
    double suspension_travel = 0.3;     ///< from hanging to fully compressed, metres, 0.001 to 100
    double suspension_hertz = 1.6;      ///< natural frequency of the body's bounce, 0.1 to 10
    double damping_ratio = 0.4;         ///< of the body's bounce, 1 is critical, 0 to 10
    double tyre_friction = 0.8;         ///< Coulomb, the same in all directions, 0 to 100
    double max_drive_force = 22e3;      ///< of all wheels at low speed, newtons, 0 to 1e12
    double max_drive_power = 120e3;     ///< at all wheels, watts, 0 to 1e12
    double max_brake_force = 30e3;      ///< of all wheels, newtons, 0 to 1e12
    double max_steer = 0.6;             ///< of the front wheels to either side, radians, 0 to 1.5
    double rolling_resistance = 0.015;  ///< force against the roll over the load, 0 to 1
    double drag_area = 1.4;             ///< drag coefficient times frontal area, m^2, 0 to 1e4
};

/// Each is clamped to its range.
struct TruckControls {
    /// -1 (backward) to 1 (forward): share of max_drive_force, limited by max_drive_power at the present speed. Against
    /// the motion it brakes.
    double throttle = 0.0;
    double brake = 0.0;  ///< 0 to 1: share of max_brake_force
    double steer = 0.0;  ///< -1 (right) to 1 (left): share of max_steer
};

/// One wheel after a step.
struct WheelState {
    WorldPos centre_world = WorldPos::Zero();  ///< centre of the wheel
    double compression = 0.0;                  ///< 0 (hanging) to suspension_travel, metres
    /// Angle turned about the wheel's axle, radians, unbounded; positive rolls forward, which is right-handed about
    /// the body's y axis. For drawing.
    double spin = 0.0;
    double steer = 0.0;      ///< about the body's z axis, radians, positive to the left
    bool on_ground = false;  ///< in contact, on the lower side as seen from the chassis
};

/// A box chassis on four wheels: spheres that are cast down, each with a spring, a damper and a tyre. As for all
/// bodies, the chassis' penetration depth never exceeds its tolerance.
///
/// Air drag of 0.5 rho drag_area v^2 with rho = 1.225 kg/m^3 acts at the centre of mass. With the defaults full
/// throttle on flat ground reaches 48 m/s.
///
/// Threads: one at a time.
class Truck {
public:
    /// @param start_world pose of the chassis
    ///
    /// Fails: invalid_argument, naming the field, for anything not finite or out of range
    static Result<Truck> create(const TruckSettings& settings, const Pose& start_world);
    Truck(Truck&&) noexcept;
    Truck& operator=(Truck&&) noexcept;
    ~Truck();

    /// Advances by dt seconds, 0 < dt <= 1. Controls that are not finite are ignored: the last valid ones are used.
    StepReport step(const Ground& ground, const TruckControls& controls, double dt);

    /// The chassis, and the settings given to create().
    const BodyState& chassis() const;
    const TruckSettings& settings() const;
    /// Front left, front right, rear left, rear right.
    std::span<const WheelState> wheels() const;
    /// True once it has touched the ground for a second since it was last upright: tilted by at most 70 degrees, or 45
    /// degrees with no wheel on the ground.
    bool is_rolled_over() const;
    BodyNeed need() const;

private:
    struct State;
    explicit Truck(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
