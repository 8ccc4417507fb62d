// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/body_id.h>
#include <terrane/collision/shapes.h>

#include <cstdint>

namespace terrane {

/// How a body moves.
enum class BodyType : std::uint8_t {
    static_body,  ///< never, but for teleport(); infinite mass
    kinematic_body,  ///< with the velocity that its owner sets, through ground and bodies; infinite mass
    dynamic_body,  ///< by gravity, forces and contacts
};

/// What a body is made of.
struct BodySettings {
    /// Of uniform density. The mass of a flat shape is on its area. In a compound with solid parts the flat ones have
    /// no mass, and overlaps count twice.
    Shape shape = Sphere{};
    BodyType type = BodyType::dynamic_body;  ///< how it moves
    double mass = 1.0;               ///< kilograms, 1e-9 to 1e12; only dynamic bodies use it
    double friction = 0.6;           ///< Coulomb, 0 to 1e6
    double restitution = 0.2;        ///< 0 to 1
    double contact_tolerance = 0.0;  ///< metres, to 1000; 0: default_contact_tolerance(shape)
    CollisionFilter filter{};        ///< which bodies it collides with; the ground always
    /// Bodies pass through it; it reports them (World::contact_events()). Static or kinematic.
    bool is_sensor = false;
    bool rotates = true;  ///< false: contacts and torques do not turn it
};

/// How a body takes part in a step.
enum class BodyCondition : std::uint8_t {
    awake,   ///< moves
    asleep,  ///< at rest, not stepped until something touches it
    /// Ground that it may meet is not resident, or it would move beyond the limit of poses: its state is kept.
    parked,
    left_world,  ///< outside the ground's extent: in free fall
    fixed,       ///< a static body
    removed,     ///< there is no body of this index
};

/// Where a body is and how it moves.
struct BodyState {
    Pose pose;                                                   ///< world_from_shape
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass, m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes, rad/s
    BodyCondition condition = BodyCondition::awake;              ///< read only
};

}  // namespace terrane
