// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"
#include "bodies/step/ground_contact_cache.h"

#include <cstdint>

namespace terrane::internal {

inline constexpr double kGravity = 9.81;  ///< default, m/s^2
/// Largest speed at which overlaps are separated, m/s. Separation leaves no velocity behind.
inline constexpr double kSeparationSpeed = 0.5;

/// Number of equal substeps of a step.
double count_substeps(double dt, double max_substep);

struct SubstepAnswer {
    /// False: ground needed for the result is not resident; the pose may have changed.
    bool resident = true;
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

/// Advances a body by `duration` seconds. Its velocity already includes the forces of the substep.
///
/// Every displacement is proved clear of an offset surface, or cast against it, so that the penetration depth is
/// bounded by construction, whatever the solver and the integrator do.
///
/// @param cache    contacts of the body with this ground
/// @param is_alone true if no island solve ran in this substep; warm-starts from the previous substep
SubstepAnswer step_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                        double gravity, double duration, bool is_alone = false);

/// Moves a body by a displacement that separates it from others: against the first clear offset surface, as far as
/// that goes, and at bounded speed. False: ground needed for the result is not resident.
bool apply_separation(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                      const Twist& displacement, double gravity, double duration);

/// Contacts that approach more slowly do not bounce, m/s: the speed that gravity gives in four substeps.
double bounce_speed(double gravity, double duration);

}  // namespace terrane::internal
