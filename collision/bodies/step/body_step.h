// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/ground_contact_cache.h"
#include "bodies/solver/rigid_body.h"

#include <cstdint>

namespace terrane::internal {

inline constexpr double kGravity = 9.81;  ///< where nobody says another, m/s^2
/// Bodies are parted from what they touch at this speed at most, and no velocity of it stays, m/s.
inline constexpr double kSeparationSpeed = 0.5;

/// How many equal substeps a step is cut in.
double count_substeps(double dt, double max_substep);

struct SubstepAnswer {
    bool resident =
        true;  ///< false: unloaded ground is in the way; the body may be part of the way
    bool touches = false;  ///< was near enough to the ground for contacts
    std::uint64_t impacts = 0;
    double simulated_time = 0.0;
    double lost_time = 0.0;

    void add(const SubstepAnswer& later) {
        resident = resident && later.resident;
        touches = later.touches;
        impacts += later.impacts;
        simulated_time += later.simulated_time;
        lost_time += later.lost_time;
    }
};

/// Moves a body by `duration` seconds. Its velocity has the forces of the substep in it already.
///
/// Every change of the pose is proved clear of the contact surface lowered by a part of the tolerance, or cast
/// against it, so that depth is bounded by construction, whatever the solver and the integrator do.
///
/// @param look     what the body has seen of the same ground before
/// @param is_alone nothing else has solved for what the ground gives in this substep: it is solved from the impulses
///                 of the substep before
SubstepAnswer step_body(RigidBody& body, GroundLook& look, const Ground& ground, double gravity,
                        double duration, bool is_alone = false);

/// Moves a body by a displacement that parts it from others, through the same gate, as far as that goes and at
/// bounded speed. False: unloaded ground is in the way.
bool push_body(RigidBody& body, GroundLook& look, const Ground& ground, const Twist& way,
               double gravity, double duration);

/// Contacts that approach more slowly are at rest and do not bounce, m/s: what gravity gives in four substeps.
double bounce_speed(double gravity, double duration);

}  // namespace terrane::internal
