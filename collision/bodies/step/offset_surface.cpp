// SPDX-License-Identifier: MIT
//
// Sources:    Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
//             Beside volumes: the body shrinks, which also holds below ceilings and beside walls. The shrunk body never
//             touches a triangle, so that no overlap along a normal is more than the offset.
// Deviations: the surface is not lowered by L, the cast shape is raised by L. A body that does not penetrate the
//             surface lowered by L separates by moving up by L, so its penetration depth is at most L.
#include "bodies/step/offset_surface.h"

#include "ground/cast/column_cast.h"
#include "ground/cast/sweep_clear.h"
#include "ground/lift/ground_lift.h"
#include "joined/joined_queries.h"

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
    answer = columns::cast(shape, piece(clear, 1.0 - clear), ground,
                           {.tolerance = tolerance, .skip_separating = true});
    answer.fraction = clear + answer.fraction * (1.0 - clear);
    return answer;
}

/// advance() beside volumes: the shrunk body is cast against all triangles.
MoveAnswer advance_on_mesh(RigidBody& body, const Ground& ground, const Motion& motion,
                           const Pose& end, OffsetSurface& surface) {
    if (!surface.is_mesh) {
        // The contacts were those of the heightfield, farther from the volumes.
        const MeshOffset first = find_mesh_offset(body, ground, surface.index);
        if (first.is_missing) return {.resident = false, .hit = false, .fraction = 0.0};
        if (first.index == kOffsetCount) return {.resident = true, .hit = true, .fraction = 0.0};
        surface.index = first.index;
        surface.is_mesh = true;
        surface.stop_gap = std::max(
            kLeastStopGap, 0.5 * std::min(first.distance, 2.0 * kStopGap * body.tolerance));
    }
    Motion path{body.pose, end.translation - body.pose.translation, Eigen::Vector3d::Zero()};
    if (!std::holds_alternative<Sphere>(*body.shape)) path.rotation_vector = motion.rotation_vector;
    const MeshSweepAnswer met =
        sweep_mesh(*body.shape, path, ground, offset_depth(body, surface.index), surface.stop_gap);
    if (met.is_missing) return {.resident = false, .hit = false, .fraction = 0.0};
    const MoveAnswer answer{
        .resident = true, .hit = met.hit, .fraction = met.hit ? met.fraction : 1.0};
    if (answer.fraction > 0.0) body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    return answer;
}

}  // namespace

OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index) {
    if (cache.is_on_mesh()) {
        const int first = std::min(std::max(index, cache.mesh_offset()), kOffsetCount - 1);
        const double room = std::min(cache.mesh_distance(), 2.0 * kStopGap * body.tolerance);
        return {first, true, std::max(kLeastStopGap, 0.5 * room), cache.clear_distance(0.0)};
    }
    const double extra_offset = offset_depth(body, index) - offset_depth(body, from);
    const double gap = cache.least_gap(extra_offset, 2.0 * kStopGap * body.tolerance);
    return {index, false, std::max(kLeastStopGap, 0.5 * gap), cache.clear_distance(extra_offset)};
}

// The lift decreases by exactly the depth of the offset surface, so one contact query serves all surfaces.
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache) {
    if (cache.is_on_mesh()) return cache.mesh_offset();
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
    if (surface.is_mesh || may_meet_volume(ground, body.pose.translation,
                                           body.radius + body.tolerance, displacement.linear)) {
        return advance_on_mesh(body, ground, motion, end, surface);
    }
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
    cache.update(body, ground,
                 length(displacement.linear) + body.radius * length(displacement.angular));
    if (!cache.is_resident()) return {.resident = false, .hit = false, .fraction = 0.0};
    const int index = first_clear_offset(body, cache);
    if (index == kOffsetCount) return {.resident = true, .hit = true, .fraction = 0.0};
    OffsetSurface surface = make_offset_surface(body, cache, 0, index);
    return advance(body, ground, displacement, surface);
}

CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance) {
    if (may_meet_volume(ground, motion.start.translation, bounding_radius(shape),
                        motion.translation)) {
        const MeshSweepAnswer met =
            sweep_mesh(shape, motion, ground, kFirstOffset * tolerance, kStopGap * tolerance);
        CastAnswer answer;
        answer.status = met.is_missing ? QueryStatus::not_resident : QueryStatus::complete;
        answer.hit = met.hit;
        answer.fraction = met.fraction;
        answer.contact.normal = met.normal;
        answer.contact.point_world = met.on_shape_world;
        return answer;
    }
    Motion path = motion;
    path.start = raised(motion.start, kFirstOffset * tolerance);
    return columns::cast(shape, path, ground,
                         {.tolerance = kStopGap * tolerance, .skip_separating = false});
}

}  // namespace terrane::internal
