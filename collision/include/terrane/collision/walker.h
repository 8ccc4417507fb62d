// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>

#include <memory>
#include <span>

namespace terrane {

struct WalkerSettings {
    double radius = 0.35;       ///< of the capsule, metres
    double half_height = 0.55;  ///< of its core, metres: it is 2 (radius + half_height) tall
    double max_slope =
        0.87;               ///< radians: what is steeper is slid down, never climbed; below pi / 2
    double max_step = 0.4;  ///< metres: what is higher is an obstacle
    double air_acceleration = 4.0;   ///< with which controls act in the air, m/s^2
    double contact_tolerance = 0.0;  ///< metres; 0: default_contact_tolerance() of the capsule
};

struct WalkerControls {
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< wanted, world x and y, m/s
    double jump_speed = 0.0;                             ///< upward, m/s, where it stands; 0: none
};

/// What stands in a walker's way: moved by its owner, never by the walker. One that check() or a question refuses
/// is not there.
struct Obstacle {
    Shape shape = Box{};
    Pose pose;
};

struct WalkerState {
    WorldPos place_world = WorldPos::Zero();  ///< centre of the capsule
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    bool stands = false;  ///< on something that it can walk on
    BodyCondition condition = BodyCondition::awake;
};

/// An upright capsule that walks: it slides along what it meets at an angle, climbs steps, stands on slopes
/// without creeping, and slides down what is too steep. It passes the same gate as every body, so it is never
/// deeper in the ground than its tolerance.
///
/// Threads:   one at a time
/// Allocates: step() nothing after the first steps
class Walker {
public:
    /// Fails with invalid_argument for anything not finite or out of range.
    static Result<Walker> create(const WalkerSettings& settings, const WorldPos& place_world);
    Walker(Walker&&) noexcept;
    Walker& operator=(Walker&&) noexcept;
    ~Walker();

    /// Moves the walker by dt seconds, 0 < dt <= 1. Controls that are not finite are refused: the last good
    /// ones are kept.
    ///
    /// Cost: a few casts of the ground and of every obstacle, a substep of 1/120 s
    StepReport step(const Ground& ground, std::span<const Obstacle> obstacles,
                    const WalkerControls& controls, double dt);

    const WalkerState& state() const;
    const WalkerSettings& settings() const;
    BodyNeed need() const;

private:
    struct State;
    explicit Walker(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
