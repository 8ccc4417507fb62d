// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/shapes.h>

#include <compare>
#include <cstdint>

namespace terrane {

/// Names a body of a world. A slot is reused with another generation, so that the id of a removed body never names
/// another body.
struct BodyId {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};  ///< index of no body

    std::uint32_t index = kNone;   ///< slot of the body
    std::uint32_t generation = 0;  ///< counts the bodies that have had the slot

    /// Whether the id names a body at all; World::contains() tells whether that body still exists.
    constexpr bool is_valid() const { return index != kNone; }

    /// Orders ids by index, then by generation.
    friend constexpr auto operator<=>(const BodyId&, const BodyId&) = default;
};

/// The layers that a body is on and the layers that it collides with, one bit each.
struct CollisionFilter {
    std::uint32_t layers = 1;                         ///< layers that the body is on; 0: none
    std::uint32_t collides_with = ~std::uint32_t{0};  ///< layers that the body collides with

    friend constexpr bool operator==(const CollisionFilter&, const CollisionFilter&) = default;
};

/// Whether two bodies collide: each is on a layer that the other collides with.
constexpr bool may_collide(const CollisionFilter& a, const CollisionFilter& b) {
    return (a.layers & b.collides_with) != 0 && (b.layers & a.collides_with) != 0;
}

/// How a body moves.
enum class BodyType : std::uint8_t {
    static_body,     ///< moves only by teleport(); infinite mass
    kinematic_body,  ///< moves through ground and bodies at a given velocity; infinite mass
    dynamic_body,    ///< is moved by gravity, forces and contacts
};

/// The properties of a body.
struct BodySettings {
    /// The shape has uniform density. The mass of a flat shape is spread over its area, but flat parts of a compound
    /// with solid parts have no mass. Overlaps of parts count twice.
    Shape shape = Sphere{};
    BodyType type = BodyType::dynamic_body;  ///< how it moves
    double mass = 1.0;               ///< kilograms, 1e-9 to 1e12; only dynamic bodies use it
    double friction = 0.6;           ///< Coulomb, 0 to 1e6
    double restitution = 0.2;        ///< 0 to 1
    double contact_tolerance = 0.0;  ///< metres, to 1000; 0: default_contact_tolerance(shape)
    CollisionFilter filter{};        ///< which bodies it collides with; not for the ground
    /// Whether bodies pass through it and are only reported in World::contact_events(). Not for dynamic bodies.
    bool is_sensor = false;
    bool rotates = true;  ///< false: contacts and torques do not turn it
};

/// How a body takes part in a step.
enum class BodyCondition : std::uint8_t {
    awake,   ///< moves
    asleep,  ///< at rest, not stepped until something touches it
    /// Held in place: ground that it may touch is not resident, or it would move beyond the limit of positions.
    parked,
    left_world,  ///< outside the ground's extent: in free fall
    fixed,       ///< a static body
    removed,     ///< no body has this index
};

/// Pose and velocities of a body.
struct BodyPlacement {
    Pose pose;                                                   ///< world_from_shape
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass, m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes, rad/s
};

/// The state of a body after a step. It can be given back as the placement of a body.
struct BodyState : BodyPlacement {
    BodyCondition condition = BodyCondition::awake;  ///< how it took part in the step
};

/// A walking upright capsule.
struct CharacterSettings {
    double radius = 0.35;  ///< of the capsule, metres, 0.001 to 1000
    double half_height =
        0.55;                 ///< of the core, metres, 0 to 1000; height: 2 (radius + half_height)
    double mass = 80.0;       ///< kilograms, 1e-3 to 1e9
    double max_slope = 0.87;  ///< radians, 0 to 1.57; it slides down steeper slopes
    double max_step = 0.4;    ///< metres, 0 to 1000; higher steps are obstacles
    /// Largest tangential force of its feet, N, 0 to 1e12. Limits its acceleration, what it can push, and how well it
    /// resists pushes.
    double strength = 1500.0;
    double air_acceleration = 4.0;   ///< by controls in the air, m/s^2, 0 to 1e6
    double contact_tolerance = 0.0;  ///< metres, to 1000; 0: default_contact_tolerance()
    CollisionFilter filter{};        ///< which bodies it collides with
};

/// Controls of a character.
struct CharacterControls {
    /// Target velocity in world x and y, m/s, each -1e4 to 1e4, relative to the body that the character stands on.
    WorldVec2 velocity = WorldVec2::Zero();
    double jump_speed = 0.0;  ///< upward, m/s, 0 to 1e4, used while it stands; 0: no jump
};

/// Pose, motion and support of a character.
struct CharacterState {
    BodyState body;       ///< its pose is at the capsule's centre
    bool stands = false;  ///< whether it stands on a slope of at most max_slope
    BodyId support{};     ///< the body that it stands on; none on the ground or in the air
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the surface that it stands on
};

/// Change of a contact between two bodies, or a body and the ground, in a step.
enum class ContactPhase : std::uint8_t {
    began,   ///< they touch, but did not after the previous step
    stayed,  ///< they touch, and did so after the previous step
    ended,   ///< they no longer touch, or one was removed
};

/// A contact of a body with another body, or with the ground, in a step.
struct ContactEvent {
    BodyId a{};                                ///< the body with the lower index
    BodyId b{};                                ///< the other body; none for the ground
    ContactPhase phase = ContactPhase::began;  ///< whether the contact began, lasts or ended
    bool is_sensor = false;  ///< one of them is a sensor: there are no points and no impulse
    /// Impulse on `a` over the step, friction included, N s. Pushing overlapping bodies apart adds none.
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, into `a`, of the deepest point
    std::uint32_t first_point = 0;                      ///< see World::contact_points()
    std::uint32_t point_count = 0;  ///< points of this contact, from first_point on

    /// Whether it is a contact with the ground.
    bool is_ground() const { return !b.is_valid(); }
};

/// A point of a contact, as found in the last collision step.
struct ContactPoint {
    WorldPos point_world = WorldPos::Zero();            ///< on body `a`
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, into body `a`
    double gap = 0.0;                                   ///< metres; negative: overlap
};

}  // namespace terrane
