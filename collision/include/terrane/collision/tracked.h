// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/truck.h>

#include <memory>
#include <span>

namespace terrane {

/// A vehicle on two tracks that turns by driving them differently. Body frame as a truck's.
struct TrackedSettings {
    Eigen::Vector3d chassis_half_extents = Eigen::Vector3d(2.6, 1.1, 0.5);
    double mass = 12'000.0;     ///< kilograms, tracks included
    int wheels_a_side = 5;      ///< road wheels, 2 to 16
    double wheel_radius = 0.4;  ///< metres
    double track_length = 3.6;  ///< between the centres of the first and the last wheel, metres
    double track = 2.2;         ///< between the tracks, metres
    double suspension_travel = 0.3;  ///< metres
    double suspension_hertz = 1.5;   ///< of the body's bounce on its springs
    double damping_ratio = 0.6;
    double track_friction = 0.9;
    double side_grip =
        0.6;  ///< friction across the tracks, as a share of that along them, 0.01 to 1
    double max_drive_force = 90'000.0;   ///< newtons, both tracks
    double max_brake_force = 100'000.0;  ///< newtons, both tracks
};

struct TrackedControls {
    double throttle = 0.0;  ///< -1 (reverse) to 1
    double brake = 0.0;     ///< 0 to 1
    double turn = 0.0;      ///< -1 (right) to 1 (left): takes from one track and gives to the other
};

/// A box chassis on two rows of wheels. The wheels of a track push with the same force, and slide across as
/// the vehicle turns: skid-steering.
///
/// Threads: one at a time.
class Tracked {
public:
    /// Fails with invalid_argument, naming the field, for anything not finite or out of range.
    /// @param start_world pose of the chassis
    static Result<Tracked> create(const TrackedSettings& settings, const Pose& start_world);
    Tracked(Tracked&&) noexcept;
    Tracked& operator=(Tracked&&) noexcept;
    ~Tracked();

    /// Controls that are not finite are refused: the last good ones are kept.
    StepReport step(const Ground& ground, const TrackedControls& controls, double dt);

    const BodyState& chassis() const;
    const TrackedSettings& settings() const;
    /// From front to rear, left before right.
    std::span<const WheelState> wheels() const;
    BodyNeed need() const;

private:
    struct State;
    explicit Tracked(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
