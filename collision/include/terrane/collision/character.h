// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/body.h>

namespace terrane {

/// A walking upright capsule.
struct CharacterSettings {
    double radius = 0.35;  ///< of the capsule, metres, 0.001 to 1000
    double half_height =
        0.55;            ///< of its core, metres, 0 to 1000: it is 2 (radius + half_height) tall
    double mass = 80.0;  ///< kilograms, 1e-3 to 1e9
    double max_slope = 0.87;  ///< radians, 0 to 1.57; it slides down steeper slopes
    double max_step = 0.4;    ///< metres, 0 to 1000; higher steps are obstacles
    /// Largest tangential force of its feet, N, 0 to 1e12. Limits its acceleration, what it can push, and how well it
    /// resists pushes.
    double strength = 1500.0;
    double air_acceleration =
        4.0;  ///< largest acceleration by controls in the air, m/s^2, 0 to 1e6
    double contact_tolerance =
        0.0;                   ///< metres, to 1000; 0: default_contact_tolerance() of the capsule
    CollisionFilter filter{};  ///< which bodies it collides with
};

/// What a character is asked to do.
struct CharacterControls {
    /// Wanted, world x and y, m/s, each -1e4 to 1e4; relative to what it stands on.
    WorldVec2 velocity = WorldVec2::Zero();
    double jump_speed = 0.0;  ///< upward, m/s, 0 to 1e4, used while it stands; 0: no jump
};

/// Where a character is and how it moves.
struct CharacterState {
    BodyState body;       ///< the pose is that of the capsule's centre
    bool stands = false;  ///< on a slope of at most max_slope
    BodyId support{};     ///< the body that it stands on; none on the ground or in the air
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of what it stands on
};

}  // namespace terrane
