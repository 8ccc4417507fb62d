// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/body_step.h"
#include "bodies/step/offset_surface.h"

#include <cstdint>

// A collision step of one body: its ground contacts are found once, islands are solved in substeps on these contacts
// with poses that are scratch, and the net displacement passes the gate.
namespace terrane::internal {

/// The time of a collision step, the same for all bodies.
struct StepSpan {
    double duration = 0.0;  ///< of the collision step, seconds
    int substep_count = 1;  ///< equal substeps of it

    double substep() const { return duration / substep_count; }
};

/// A body at the start of a collision step.
struct StepStart {
    enum class Kind : std::uint8_t {
        moving,      ///< takes part
        too_deep,    ///< penetrates all offset surfaces: recovers, and has no other motion
        unresident,  ///< ground that it may meet is not resident
    };
    Kind kind = Kind::moving;
    Pose pose;
    OffsetSurface surface;  ///< the highest that the body does not penetrate
};

/// Finds the ground contacts that a body may have within the step. Bodies above all ground that they could reach have
/// none.
///
/// @param ground_before that of the collision step before, null if there was none
StepStart begin_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                               const Ground* ground_before, const StepSpan& span);

/// Moves a body from its start to its present pose along one motion against the start's offset surface. Where that is
/// proved only in part, the body stops at the proved share, and step_body() simulates it alone for the remaining time.
SubstepAnswer end_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                                 const StepStart& start, const StepSpan& span);

/// Recovers a body that is too deep for the whole step.
SubstepAnswer recover_for_step(RigidBody& body, const Ground& ground, const StepSpan& span);

}  // namespace terrane::internal
