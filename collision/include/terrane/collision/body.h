// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/shapes.h>

#include <compare>
#include <cstdint>

namespace terrane {

/// Names a body of a world. Slots of removed bodies are used again with another generation, so that the id of a removed
/// body never names another one.
struct BodyId {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};  ///< index of no body

    std::uint32_t index = kNone;   ///< slot of the body
    std::uint32_t generation = 0;  ///< counts the bodies that have had the slot

    /// Whether it names a body; only its world knows whether that body still exists.
    constexpr bool is_valid() const { return index != kNone; }

    /// By index, then by generation.
    friend constexpr auto operator<=>(const BodyId&, const BodyId&) = default;
};

/// Layers as bits: which a body is on, and which it collides with.
struct CollisionFilter {
    std::uint32_t layers = 1;                         ///< that the body is on; 0: on none
    std::uint32_t collides_with = ~std::uint32_t{0};  ///< layers that the body collides with

    friend constexpr bool operator==(const CollisionFilter&, const CollisionFilter&) = default;
};

/// Whether two bodies collide: each is on a layer that the other collides with.
constexpr bool may_collide(const CollisionFilter& a, const CollisionFilter& b) {
    return (a.layers & b.collides_with) != 0 && (b.layers & a.collides_with) != 0;
}

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

/// The pose and the velocities that a body is given.
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

/// What a step did to a contact of two bodies, or of a body with the ground.
enum class ContactPhase : std::uint8_t {
    began,   ///< they touch, and did not after the step before
    stayed,  ///< they touch, and did so after the step before
    ended,   ///< they do not touch any more, or one has been removed
};

/// A contact of a body with another body, or with the ground, in a step.
struct ContactEvent {
    BodyId a{};                                ///< the body of the lower index
    BodyId b{};                                ///< the other one; of the ground: none
    ContactPhase phase = ContactPhase::began;  ///< whether the contact began, lasts or ended
    bool is_sensor = false;  ///< one of them is a sensor: there are no points and no impulse
    /// Of the contact on `a` over the step, friction included, N s. Separation of overlaps has none.
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
