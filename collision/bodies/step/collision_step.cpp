// SPDX-License-Identifier: MIT
//
// Sources:    Mirtich. Impulse-based dynamic simulation of rigid body systems. PhD thesis 1996, chapters 2 and 3.
//             Catto. Solver2D and the soft step. 2024 (contacts found once a step, substeps on them).
// Deviations: the poses of the substeps are scratch. Only the net displacement is made, and only as far as it is
//             proved clear of an offset surface.
#include "bodies/step/collision_step.h"

#include "bodies/step/body_depth.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// How far the contacts of a collision step are searched beyond the contact margin, metres: as far as the body may
/// move, at most its smallest half extent and the spacing of the ground.
double contact_reach(const RigidBody& body, const Ground& ground, const StepSpan& span) {
    const double most = std::min(body.thickness, ground.spacing());
    const double fall = length(body.acceleration) * span.duration * span.duration;
    return std::min(most, greatest_speed(body) * span.duration + fall);
}

}  // namespace

StepStart begin_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                               const Ground* ground_before, const StepSpan& span) {
    StepStart start;
    start.pose = body.pose;
    const Eigen::Vector3d reach =
        body.velocity.linear * span.duration + body.acceleration * (span.duration * span.duration);
    // One that has contacts is near the ground: the test would not pass.
    if (!cache.has_contacts() && is_swept_sphere_clear(body, ground, reach)) {
        cache.set_out_of_reach();
    } else {
        const double travel =
            length(reach) + body.radius * length(body.velocity.angular) * span.duration;
        cache.refresh_for_step(body, ground, ground_before, contact_reach(body, ground, span),
                               travel);
        if (!cache.is_resident()) {
            start.kind = StepStart::Kind::unresident;
            return start;
        }
    }
    const int offset = first_clear_offset(body, cache);
    const bool is_deep = offset == kOffsetCount;
    if (body.is_fresh || !is_deep) body.started_deep = is_deep;
    body.is_fresh = false;
    if (is_deep) {
        start.kind = StepStart::Kind::too_deep;
        return start;
    }
    body.escape_translation.setZero();
    start.surface = make_offset_surface(body, cache, 0, offset);
    return start;
}

SubstepAnswer end_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                                 const StepStart& start, const StepSpan& span) {
    SubstepAnswer answer;
    answer.simulated_time = span.duration;
    answer.touches = cache.is_near(body);
    const Pose end = body.pose;
    Twist displacement{end.translation - start.pose.translation, Eigen::Vector3d::Zero()};
    if (!(end.rotation == start.pose.rotation)) {
        displacement.angular = rotation_vector_between(start.pose.rotation, end.rotation);
    }
    body.pose = start.pose;
    OffsetSurface surface = start.surface;
    if (cache.is_out_of_reach()) {
        // Others may have pushed the body out of what was clear when the step began.
        const bool is_clear = is_swept_sphere_clear(body, ground, displacement.linear);
        if (!is_clear) surface.clear_distance = 0.0;
    }
    const MoveAnswer moved =
        advance(body, ground, displacement, surface, HitSearch::stop_at_proved);
    if (!moved.resident) {
        answer.resident = false;
        return answer;
    }
    if (!moved.hit) {
        if (surface.index == 0 && !surface.is_mesh) cache.set_proved_clear(body);
        return answer;
    }
    const double left = (1.0 - moved.fraction) * span.duration;
    answer.simulated_time = span.duration - left;
    ++answer.impacts;
    answer.touches = true;
    conserve_momentum(body, end.rotation);
    cache.invalidate();
    if (!(left > 0.0)) return answer;
    const double pieces = std::ceil(left / span.substep());
    for (double piece = 0.0; piece < pieces && answer.resident; piece += 1.0) {
        answer.add(step_body(body, cache, ground, left / pieces));
    }
    // The velocity has the work of gravity down to the end that was not reached.
    if (answer.resident) compensate_height_gain(body, end.translation);
    return answer;
}

SubstepAnswer recover_for_step(RigidBody& body, const Ground& ground, const StepSpan& span) {
    SubstepAnswer answer;
    answer.touches = true;
    answer.resident = recover(body, ground, span.duration);
    answer.simulated_time = span.duration;
    return answer;
}

}  // namespace terrane::internal
