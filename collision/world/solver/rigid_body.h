// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"

#include <terrane/collision/body.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {

/// The part of a body's state that steps change.
struct BodyMotion {
    Pose pose;
    Twist velocity;
    bool started_deep = false;  ///< was placed deeper than its tolerance and still recovers
    bool is_fresh = true;       ///< not stepped since it was placed
    /// Remaining recovery translation of a body that penetrates too deeply, metres.
    Eigen::Vector3d escape_translation = Eigen::Vector3d::Zero();
};

/// The state that a substep of a rigid body reads and writes.
struct RigidBody : BodyMotion {
    static constexpr std::uint32_t kNoPart = ~std::uint32_t{0};

    const Shape* shape = nullptr;  ///< centred: see make_centred(); it outlives the body
    double radius = 0.0;           ///< bounding radius about the origin, metres
    double thickness = 0.0;        ///< smallest half extent, metres
    MassProperties mass;
    double friction = 0.0;
    double restitution = 0.0;
    double tolerance = 0.01;  ///< largest penetration depth, metres, > 0
    CollisionFilter filter;
    bool is_sensor = false;
    /// Compound parts from this index on are wheels: they roll, so their contacts have no friction.
    std::uint32_t first_wheel_part = kNoPart;
    /// Acceleration by gravity and the forces of the step, m/s^2.
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

/// Radius of a sphere or capsule; 0 for shapes with corners. For a compound, the radius of one of its parts.
inline double rounding_of(const auto& shape) {
    if (const auto* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const auto* capsule = std::get_if<Capsule>(&shape)) return capsule->radius;
    return 0.0;
}
inline double rounding_of(const Shape& shape, std::uint32_t part) {
    if (const auto* compound = std::get_if<Compound>(&shape)) {
        return rounding_of(compound->parts()[part].shape);
    }
    return rounding_of(shape);
}

/// Combines the friction and restitution of two surfaces.
inline double combined_friction(double a, double b) { return std::sqrt(a * b); }
inline double combined_restitution(double a, double b) { return std::max(a, b); }

/// Friction of a part of a body.
inline double friction_of(const RigidBody& body, std::uint32_t part) {
    return part >= body.first_wheel_part ? 0.0 : body.friction;
}

/// Whether forces and contacts move a body.
inline bool is_dynamic(const RigidBody& body) { return body.mass.inverse_mass > 0.0; }

/// Upper bound of the speed of a body's points, m/s.
inline double greatest_speed(const RigidBody& body) {
    return length(body.velocity.linear) + body.radius * length(body.velocity.angular);
}

/// Upper bound of the distance that a point of a body moves between two poses, metres.
double greatest_move(const RigidBody& body, const Pose& from, const Pose& to);

/// Rotation vector of a free motion, radians. In flight it uses the spin at the middle of the interval; in contact, the
/// solved spin at the start.
/// @param is_flying whether no contact was solved
Eigen::Vector3d rotation_in(const RigidBody& body, double duration, bool is_flying);

/// Moves a body freely, conserving its angular momentum and never adding energy.
/// @param is_flying as for rotation_in()
void integrate(RigidBody& body, double duration, bool is_flying);

/// Updates the spin of a rotated body to conserve its angular momentum; scales it down if that would add energy.
/// @param rotation_before rotation for which the spin was computed
void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before);

/// Scales a displacement so that no point moves by more than `most` metres.
Twist clamp_displacement(Twist displacement, double radius, double most);

/// Reduces the kinetic energy by the potential energy that separation has added, at most to zero.
/// @param before position before the separation
void compensate_height_gain(RigidBody& body, const WorldPos& before);

}  // namespace terrane::internal
