// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"
#include "bodies/step/ground_contact_cache.h"

#include <cstdint>

namespace terrane::internal {

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
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  ///< of the ground in step_body(), N s

    void add(const SubstepAnswer& later) {
        resident = resident && later.resident;
        touches = later.touches;
        impacts += later.impacts;
        simulated_time += later.simulated_time;
        lost_time += later.lost_time;
        impulse += later.impulse;
    }
};

/// Advances a body by `duration` seconds. Its velocity already includes its acceleration over that time.
///
/// Every displacement is proved clear of an offset surface, or cast against it, so that the penetration depth is
/// bounded by construction, whatever the solver and the integrator do.
///
/// @param cache contacts of the body with this ground
SubstepAnswer step_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                        double duration);

/// Moves a body freely, conserving its angular momentum and never adding energy.
/// @param is_flying no contact was solved: the spin is that of the middle of the time
void integrate(RigidBody& body, double duration, bool is_flying);

/// Gives a body that has turned since its spin was found the spin of the same angular momentum, or less: energy is
/// never added.
/// @param rotation_before rotation at which the spin was found
void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before);

/// Scales a displacement down so that no point moves by more than `most` metres.
Twist clamp_displacement(Twist displacement, double radius, double most);

/// Takes the potential energy of the acceleration that separation has added from the kinetic energy, as far as there is
/// any.
/// @param before where the body was
void compensate_height_gain(RigidBody& body, const WorldPos& before);

/// Recovers a body that penetrates all offset surfaces: moves it along its escape translation at bounded speed, without
/// other motion. The remaining translation bounds the depth, so the depth decreases by the distance moved; a new
/// translation replaces it only where it is shorter. False: ground needed for the result is not resident.
bool recover(RigidBody& body, const Ground& ground, double duration);

/// Contacts that approach more slowly do not bounce, m/s: the speed that the acceleration gives in four substeps.
/// @param acceleration m/s^2, >= 0
double bounce_speed(double acceleration, double duration);

}  // namespace terrane::internal
