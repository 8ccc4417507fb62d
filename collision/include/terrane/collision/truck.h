// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>

#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Front left, front right, rear left, rear right. Body frame: x forward, y left, z up, origin at
/// the chassis box's centre.
struct TruckSettings {
    Eigen::Vector3d chassis_half_extents = Eigen::Vector3d(2.4, 1.0, 0.6);
    double mass = 3500.0;            ///< kilograms, wheels included
    double wheel_radius = 0.5;       ///< metres
    double wheelbase = 3.2;          ///< between axles, metres
    double track = 1.8;              ///< between wheels of an axle, metres
    double suspension_travel = 0.4;  ///< metres
    double suspension_hertz = 1.6;   ///< of the body's bounce on its springs
    double damping_ratio = 0.5;
    double tyre_friction = 0.9;
    double max_drive_force = 16'000.0;  ///< newtons, all wheels
    double max_brake_force = 30'000.0;  ///< newtons, all wheels
    double max_steer = 0.6;             ///< radians
};

struct TruckControls {
    double throttle = 0.0;  ///< -1 (reverse) to 1
    double brake = 0.0;     ///< 0 to 1
    double steer = 0.0;     ///< -1 (right) to 1 (left)
};

struct WheelState {
    WorldPos centre_world = WorldPos::Zero();
    double compression = 0.0;  ///< 0 (hanging) to suspension_travel, metres
    double spin = 0.0;         ///< radians turned, for drawing
    double steer = 0.0;        ///< radians
    bool on_ground = false;
};

/// A box chassis that passes the same gate as every body, on four wheels: spheres that are cast
/// down, with spring, damper and tyre.
class Truck {
public:
    /// @param start_world pose of the chassis
    static Result<Truck> create(const TruckSettings& settings, const Pose& start_world);
    Truck(Truck&&) noexcept;
    Truck& operator=(Truck&&) noexcept;
    ~Truck();

    /// Controls that are not finite are refused: the last good ones are kept.
    StepReport step(const Ground& ground, const TruckControls& controls, double dt);

    const BodyState& chassis() const;
    const TruckSettings& settings() const;
    std::span<const WheelState> wheels() const;  ///< four
    BodyNeed need() const;

private:
    struct State;
    explicit Truck(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Controls that take a truck along a line of points.
class PathDriver {
public:
    /// Requires at least two points. @param cruise_speed m/s, > 0
    PathDriver(std::vector<Eigen::Vector2d> points_world, double cruise_speed);
    TruckControls drive(const Truck& truck);
    /// Whether the last point was passed.
    bool is_done() const { return done_; }

private:
    std::vector<Eigen::Vector2d> points_;
    double cruise_speed_ = 0.0;
    std::size_t next_ = 1;
    bool done_ = false;
};

}  // namespace terrane
