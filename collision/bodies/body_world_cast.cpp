// SPDX-License-Identifier: MIT
#include "bodies/body_world_state.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::dot;
using internal::length;

/// Squared distance of a point from a segment.
double square_distance(const WorldPos& point, const WorldPos& from,
                       const Eigen::Vector3d& displacement) {
    const Eigen::Vector3d there = point - from;
    const double square = dot(displacement, displacement);
    const double share =
        square > 0.0 ? std::clamp(dot(there, displacement) / square, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d between = there - share * displacement;
    return dot(between, between);
}

}  // namespace

WorldCastAnswer BodyWorld::cast(const Ground& ground, const Shape& shape, const Motion& motion,
                                std::size_t except) const {
    const CastSettings settings{.skip_separating = true};
    WorldCastAnswer answer;
    const CastAnswer below = terrane::cast(shape, motion, ground, settings);
    answer.status = below.status;
    if (below.status == QueryStatus::invalid) return answer;
    answer.fraction = below.fraction;  // of missing ground, where that comes first
    if (below.hit) {
        answer.hit = true;
        answer.point_world = below.contact.point_world;
        answer.normal = below.contact.normal;
    }
    const double radius = bounding_radius(shape) + settings.tolerance;
    for (std::size_t i = 0; i < state_->bodies.size(); ++i) {
        const internal::RigidBody& body = state_->bodies[i];
        const double reach = radius + body.radius;
        if (i == except || square_distance(body.pose.translation, motion.start.translation,
                                           motion.translation) > reach * reach) {
            continue;
        }
        const PairCastAnswer hit =
            terrane::cast(shape, motion, body.parts[0].shape, Motion{body.pose}, settings);
        // Ties: the body with the lower index, and a body before the ground.
        const bool is_sooner = answer.body == WorldCastAnswer::kGround
                                   ? hit.fraction <= answer.fraction
                                   : hit.fraction < answer.fraction;
        if (!hit.hit || hit.count == 0 || !is_sooner) continue;
        answer.status = QueryStatus::complete;
        answer.hit = true;
        answer.fraction = hit.fraction;
        answer.body = i;
        answer.point_world = hit.contacts[0].point_world;
        answer.normal = hit.contacts[0].normal;
    }
    return answer;
}

}  // namespace terrane
