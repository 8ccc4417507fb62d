// SPDX-License-Identifier: MIT
//
// Sources:    Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
// Deviations: the surface is not lowered by L, the cast shape is raised by L. A body that does not penetrate the
//             surface lowered by L separates by moving up by L, so its penetration depth is at most L.
#include "bodies/step/offset_surface.h"

#include "ground/cast/sweep_clear.h"
#include "ground/lift/ground_lift.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Swept tests are tried on pieces halved down to this share of the motion; the remainder is cast.
constexpr double kLeastProved = 1.0 / 16.0;
/// Least stop gap, metres, little more than rounding: a body closer than kStopGap may move away.
constexpr double kLeastStopGap = 1e-11;

/// Casts the rest of a motion after the pieces that the swept test proves clear: usually most of the motion up to a
/// hit.
CastAnswer find_hit(const Shape& shape, const Motion& motion, const Ground& ground,
                    double tolerance, HitSearch hits) {
    const auto piece = [&](double from, double share) -> Motion {
        return {motion.at(from), share * motion.translation, share * motion.rotation_vector};
    };
    double clear = 0.0;
    for (double share = 1.0; share >= kLeastProved && clear < 1.0; share *= 0.5) {
        if (is_sweep_clear(shape, piece(clear, share), ground, tolerance)) clear += share;
    }
    CastAnswer answer;
    answer.status = QueryStatus::complete;
    if (clear == 1.0) return answer;
    if (clear > 0.0 && hits == HitSearch::stop_at_proved) {
        answer.hit = true;
        answer.fraction = clear;
        return answer;
    }
    answer = cast(shape, piece(clear, 1.0 - clear), ground,
                  {.tolerance = tolerance, .skip_separating = true});
    answer.fraction = clear + answer.fraction * (1.0 - clear);
    return answer;
}

}  // namespace

OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index) {
    const double extra_offset = offset_depth(body, index) - offset_depth(body, from);
    const double gap = cache.least_gap(extra_offset, 2.0 * kStopGap * body.tolerance);
    return {index, std::max(kLeastStopGap, 0.5 * gap), cache.clear_distance(extra_offset)};
}

// The lift decreases by exactly the depth of the offset surface, so one contact query serves all surfaces.
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache) {
    const double clear = kStopGap * body.tolerance;
    int index = 0;
    for (; index < kOffsetCount; ++index) {
        const double extra_offset = offset_depth(body, index) - offset_depth(body, 0);
        if (cache.lift() > extra_offset) continue;
        if (index + 1 == kOffsetCount || cache.least_gap(extra_offset, clear) >= clear) break;
        // The steps to all later surfaces are smaller than the gap needed: take this one.
        if (offset_depth(body, index + 1) - offset_depth(body, index) < 2.0 * clear) break;
    }
    return index;
}

bool is_swept_sphere_clear(const RigidBody& body, const Ground& ground,
                           const Eigen::Vector3d& displacement) {
    const LocalGround local(ground, body.pose.translation);
    const Eigen::Vector3d half_move = 0.5 * displacement;
    const Eigen::Vector3d centre = local.to_local(body.pose.translation) + half_move;
    const Eigen::Vector3d half =
        half_move.cwiseAbs() + Eigen::Vector3d::Constant(body.radius + body.tolerance);
    return is_finite(half) && is_finite(body.velocity.angular) &&
           centre.z() - half.z() > bound_ground(local, centre, half);
}

MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                   OffsetSurface& surface, HitSearch hits) {
    const Motion motion{body.pose, displacement.linear, displacement.angular};
    const Pose end = motion.at(1.0);
    MoveAnswer answer;
    const double reach = length(displacement.linear) + body.radius * length(displacement.angular);
    if (reach <= surface.clear_distance) {
        surface.clear_distance -= reach;
        body.pose = end;
        return answer;
    }
    surface.clear_distance = 0.0;
    Motion path{raised(body.pose, offset_depth(body, surface.index)),
                end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (!std::holds_alternative<Sphere>(*body.shape)) path.rotation_vector = displacement.angular;
    const CastAnswer hit = find_hit(*body.shape, path, ground, surface.stop_gap, hits);
    if (hit.status == QueryStatus::not_resident || hit.status == QueryStatus::invalid) {
        return {.resident = false, .hit = false, .fraction = 0.0};
    }
    answer.hit = hit.hit;
    if (hit.hit) answer.fraction = std::min(answer.fraction, hit.fraction);
    if (answer.fraction > 0.0) {
        body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    }
    return answer;
}

MoveAnswer move_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                     const Twist& displacement) {
    cache.update(body, ground);
    if (!cache.is_resident()) return {.resident = false, .hit = false, .fraction = 0.0};
    const int index = first_clear_offset(body, cache);
    if (index == kOffsetCount) return {.resident = true, .hit = true, .fraction = 0.0};
    OffsetSurface surface = make_offset_surface(body, cache, 0, index);
    return advance(body, ground, displacement, surface);
}

CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance) {
    Motion path = motion;
    path.start = raised(motion.start, kFirstOffset * tolerance);
    return cast(shape, path, ground, {.tolerance = kStopGap * tolerance, .skip_separating = false});
}

}  // namespace terrane::internal
