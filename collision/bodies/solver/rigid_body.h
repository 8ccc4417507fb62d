// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/contact_solver.h"

#include <span>

namespace terrane::internal {

/// A shape that belongs to a body. Only spheres may stand off the body's origin.
struct BodyPart {
    Shape shape = Sphere{};
    Eigen::Vector3d offset_body = Eigen::Vector3d::Zero();
};

/// What steps change of a body.
struct BodyMotion {
    Pose pose;
    Twist velocity;
    bool started_deep = false;  ///< was put in deeper than its tolerance and is not out yet
    bool is_fresh = true;       ///< was put somewhere, and has not been looked at yet
    /// A translation that takes a deep body out: what is left of the way that it is on.
    Eigen::Vector3d way_out = Eigen::Vector3d::Zero();
};

/// Everything that one substep of a rigid body reads and writes.
struct RigidBody : BodyMotion {
    std::span<const BodyPart> parts;  ///< at least one; they outlive the body
    double radius = 0.0;              ///< bounding, around the origin
    double thickness = 0.0;           ///< smallest half extent
    MassProperties mass;
    double friction = 0.0;
    double restitution = 0.0;
    double tolerance = 0.01;  ///< depth that the body never exceeds, metres, > 0
};

inline Pose part_pose(const BodyPart& part, const Pose& pose) {
    return {pose.rotation, pose.translation + rotated(pose.rotation, part.offset_body)};
}

/// Radius of the sphere that rolls where a shape touches, with a part of it if it is a compound; 0 for corners.
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

/// Speed of a body's fastest point at most, m/s.
inline double greatest_speed(const RigidBody& body) {
    return length(body.velocity.linear) + body.radius * length(body.velocity.angular);
}

/// How far the points of a body have moved at most between two poses, metres.
double greatest_move(const RigidBody& body, const Pose& from, const Pose& to);

}  // namespace terrane::internal
