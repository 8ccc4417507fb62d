// SPDX-License-Identifier: MIT
//
// Sources:    Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
// Deviations: lowering the surface by L equals raising the shape by L, which is how the cast is asked; and a body that
//             does not meet the surface lowered by L is freed by moving up by L, so its depth is at most L.
#include "bodies/step/offset_surface.h"

#include "ground/cast/clear_way.h"
#include "ground/lift/ground_lift.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Proofs that the way is clear get shorter by halves down to this share of it, then it is cast.
constexpr double kLeastProved = 1.0 / 16.0;
/// Where the cast stops at least, metres, little more than rounding: a body that is closer than kStopGap may
/// move away.
constexpr double kLeastStopGap = 1e-11;

/// Casts what of a motion is not proved to be clear. Where something is met, most of the way to it is proved.
CastAnswer find_hit(const Shape& shape, const Motion& motion, const Ground& ground,
                    double tolerance) {
    const auto piece = [&](double from, double share) -> Motion {
        return {motion.at(from), share * motion.translation, share * motion.rotation_vector};
    };
    double clear = 0.0;
    for (double share = 1.0; share >= kLeastProved && clear < 1.0; share *= 0.5) {
        if (is_way_clear(shape, piece(clear, share), ground, tolerance)) clear += share;
    }
    CastAnswer answer;
    answer.status = QueryStatus::complete;
    if (clear == 1.0) return answer;
    answer = cast(shape, piece(clear, 1.0 - clear), ground,
                  {.tolerance = tolerance, .skip_separating = true});
    answer.fraction = clear + answer.fraction * (1.0 - clear);
    return answer;
}

}  // namespace

Gate make_gate(const RigidBody& body, const GroundLook& look, int from, int index) {
    const double further = lowering(body, index) - lowering(body, from);
    const double gap = look.least_gap(further, 2.0 * kStopGap * body.tolerance);
    return {index, std::max(kLeastStopGap, 0.5 * gap), look.free_way(body, further)};
}

// The lift falls by exactly what the surface is lowered by, so one look is enough.
int find_gate(const RigidBody& body, const GroundLook& look) {
    const double clear = kStopGap * body.tolerance;
    int gate = 0;
    for (; gate < kGateCount; ++gate) {
        const double further = lowering(body, gate) - lowering(body, 0);
        if (look.lift() > further) continue;
        if (gate + 1 == kGateCount || look.least_gap(further, clear) >= clear) break;
        // Further gates are nearer to each other than this: the next one has to do.
        if (lowering(body, gate + 1) - lowering(body, gate) < 2.0 * clear) break;
    }
    return gate;
}

bool is_too_deep(const RigidBody& body, const GroundLook& look) {
    return find_gate(body, look) == kGateCount;
}

bool flies_high(const RigidBody& body, const Ground& ground, double duration) {
    const LocalGround local(ground, body.pose.translation);
    const Eigen::Vector3d half_way = 0.5 * duration * body.velocity.linear;
    const Eigen::Vector3d centre = local.to_local(body.pose.translation) + half_way;
    const Eigen::Vector3d half =
        half_way.cwiseAbs() + Eigen::Vector3d::Constant(body.radius + body.tolerance);
    return is_finite(half) && is_finite(body.velocity.angular) &&
           centre.z() - half.z() > bound_ground(local, centre, half);
}

MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& way, Gate& gate) {
    const Motion motion{body.pose, way.linear, way.angular};
    const Pose end = motion.at(1.0);
    MoveAnswer answer;
    const double reach = length(way.linear) + body.radius * length(way.angular);
    if (reach <= gate.free_way) {
        gate.free_way -= reach;
        body.pose = end;
        return answer;
    }
    gate.free_way = 0.0;
    for (const BodyPart& part : body.parts) {
        Motion path;
        path.start = raised(part_pose(part, body.pose), lowering(body, gate.index));
        const bool is_sphere = std::holds_alternative<Sphere>(part.shape);
        path.translation =
            part_pose(part, end).translation - part_pose(part, body.pose).translation;
        if (!is_sphere) path.rotation_vector = way.angular;
        const CastAnswer hit = find_hit(part.shape, path, ground, gate.stop_gap);
        if (hit.status == QueryStatus::not_resident || hit.status == QueryStatus::invalid) {
            return {.resident = false, .hit = false, .fraction = 0.0};
        }
        if (!hit.hit) continue;
        answer.hit = true;
        answer.fraction = std::min(answer.fraction, hit.fraction);
    }
    if (answer.fraction > 0.0) {
        body.pose = answer.fraction < 1.0 ? motion.at(answer.fraction) : end;
    }
    return answer;
}

MoveAnswer move_body(RigidBody& body, GroundLook& look, const Ground& ground, const Twist& way) {
    look.update(body, ground);
    if (!look.is_resident()) return {.resident = false, .hit = false, .fraction = 0.0};
    const int index = find_gate(body, look);
    if (index == kGateCount) return {.resident = true, .hit = true, .fraction = 0.0};
    Gate gate = make_gate(body, look, 0, index);
    return advance(body, ground, way, gate);
}

double contact_raise(double tolerance) { return kFirstGate * tolerance; }

CastAnswer cast_part(const Shape& shape, const Motion& motion, const Ground& ground,
                     double tolerance) {
    Motion path = motion;
    path.start = raised(motion.start, contact_raise(tolerance));
    return cast(shape, path, ground, {.tolerance = kStopGap * tolerance, .skip_separating = false});
}

}  // namespace terrane::internal
