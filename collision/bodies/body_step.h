// SPDX-License-Identifier: MIT
#pragma once

#include "contact_solver.h"

#include <terrane/collision/ground_cast.h>

#include <array>
#include <cstdint>
#include <span>

namespace terrane::internal {

/// A shape that belongs to a body. Only spheres may stand off the body's origin.
struct BodyPart {
    Shape shape = Sphere{};
    Eigen::Vector3d offset_body = Eigen::Vector3d::Zero();
};

/// Everything that one substep of a rigid body reads and writes.
struct RigidBody {
    static constexpr std::size_t kMaxParts = 5;

    std::array<BodyPart, kMaxParts> parts;
    std::size_t part_count = 1;
    double radius = 0.0;  ///< bounding, around the origin
    MassProperties mass;
    double friction = 0.0;
    double restitution = 0.0;
    double tolerance = 0.01;  ///< depth that the body never exceeds, metres, > 0

    Pose pose;
    Twist velocity;
    bool started_deep = false;  ///< was put in deeper than its tolerance and is not out yet
    bool is_fresh = true;       ///< was put somewhere, and has not been looked at yet
    /// A translation that takes a deep body out: what is left of the way that it is on.
    Eigen::Vector3d way_out = Eigen::Vector3d::Zero();

    std::span<const BodyPart> active_parts() const { return {parts.data(), part_count}; }
};

struct SubstepAnswer {
    bool resident =
        true;  ///< false: unloaded ground is in the way; the body may be part of the way
    bool touches = false;  ///< was near enough to the ground for contacts
    std::uint64_t impacts = 0;
    double lived_time = 0.0;
    double lost_time = 0.0;
};

/// Moves a body by `duration` seconds. Its velocity has the forces of the substep in it already.
///
/// Every change of the pose is cast against the contact surface lowered by half the tolerance, so
/// that depth is bounded by construction, whatever the solver and the integrator do.
SubstepAnswer step_body(RigidBody& body, const Ground& ground, double gravity, double duration);

/// Casts a part of a body as the gate does: against the surface that is lowered for bodies of this
/// tolerance. The contact that comes back is raised by as much: see `contact_raise`.
CastAnswer cast_part(const Shape& shape, const Motion& motion, const Ground& ground,
                     double tolerance);
double contact_raise(double tolerance);

/// How deep a body is in the contact surface, metres: the largest of `at_least` and its signed depth.
/// Cheap while the body's lift is below `at_least`.
double deepest(const RigidBody& body, const Ground& ground, double at_least);

}  // namespace terrane::internal
