// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <memory>
#include <span>

namespace terrane {

/// Settings of a walker. Fixed once it is created.
struct WalkerSettings {
    double radius = 0.35;            ///< of the capsule, metres
    double half_height = 0.55;       ///< of its core, metres: it is 2 (radius + half_height) tall
    double max_slope = 0.87;         ///< radians, below pi / 2; it slides down steeper slopes
    double max_step = 0.4;           ///< metres; higher steps are obstacles
    double air_acceleration = 4.0;   ///< largest acceleration by controls in the air, m/s^2
    double contact_tolerance = 0.0;  ///< metres; 0: default_contact_tolerance() of the capsule
};

/// What a walker is asked to do in a step.
struct WalkerControls {
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< wanted, world x and y, m/s
    double jump_speed = 0.0;  ///< upward, m/s, used while it stands; 0: no jump
};

/// A shape that blocks a walker. Its owner moves it, the walker never does. Ignored where check() or a query refuses
/// it.
struct Obstacle {
    Shape shape = Box{};  ///< of the obstacle
    Pose pose;            ///< world_from_shape
};

/// Where a walker is and how it moves.
struct WalkerState {
    WorldPos place_world = WorldPos::Zero();  ///< centre of the capsule
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    bool stands = false;  ///< on a slope of at most max_slope
    BodyCondition condition = BodyCondition::awake;
};

/// A walking upright capsule: it slides along walls, climbs steps, stands on slopes without creeping, and slides down
/// slopes that are too steep. As for all bodies, its penetration depth never exceeds its tolerance.
///
/// Threads:   one at a time
/// Allocates: step() nothing after the first steps
class Walker {
public:
    /// Fails: invalid_argument for anything not finite or out of range
    static Result<Walker> create(const WalkerSettings& settings, const WorldPos& place_world);
    Walker(Walker&&) noexcept;
    Walker& operator=(Walker&&) noexcept;
    ~Walker();

    /// Advances the walker by dt seconds, 0 < dt <= 1. Controls that are not finite are ignored: the last valid ones
    /// are used.
    ///
    /// Cost: a few casts against the ground and every obstacle in each substep of 1/120 s
    StepReport step(const Ground& ground, std::span<const Obstacle> obstacles,
                    const WalkerControls& controls, double dt);

    /// State after the last step, the settings given to create(), and what a pager is to keep resident.
    const WalkerState& state() const;
    const WalkerSettings& settings() const;
    BodyNeed need() const;

private:
    struct State;
    explicit Walker(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
