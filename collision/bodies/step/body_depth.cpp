// SPDX-License-Identifier: MIT
#include "bodies/step/body_depth.h"

#include "ground/lift/ground_lift.h"
#include "joined/joined_queries.h"

#include <algorithm>

namespace terrane::internal {
Depth compute_depth(const RigidBody& body, const Ground& ground) {
    Depth deepest;
    const DistanceAnswer answer = signed_distance(*body.shape, body.pose, ground, 0.0);
    deepest.resident = answer.status != QueryStatus::not_resident;
    if (!answer.has_ground || !(answer.distance < 0.0)) return deepest;
    deepest.depth = -answer.distance;
    deepest.normal = answer.normal;
    return deepest;
}

bool is_outside(const Ground& ground, const WorldPos& point) {
    return !ground.extent().contains(point.x(), point.y()) ||
           ground.cell(ground.column_at(point.x()), ground.row_at(point.y())).status ==
               GroundStatus::outside;
}

double greatest_lift(const RigidBody& body, const Ground& ground) {
    if (may_meet_volume(ground, body.pose.translation, body.radius)) {
        return measure_mesh_depth(*body.shape, body.pose, ground).depth;
    }
    const LocalGround local(ground, body.pose.translation);
    const LocalBody there(*body.shape, body.pose.rotation, local.to_local(body.pose.translation));
    return std::max(0.0, find_lift(local, there, Eigen::Vector3d::Zero(), 0.0).lift);
}

double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least) {
    if (lift <= at_least) return at_least;
    if (may_meet_volume(ground, body.pose.translation, body.radius))
        return lift;  // it is the depth
    return std::max(at_least, compute_depth(body, ground).depth);
}

}  // namespace terrane::internal
