// SPDX-License-Identifier: MIT
#include "bodies/step/body_depth.h"

#include "ground/lift/ground_lift.h"

#include <algorithm>

namespace terrane::internal {

Depth compute_depth(const RigidBody& body, const Ground& ground) {
    Depth deepest_part;
    for (const BodyPart& part : body.parts) {
        const DistanceAnswer answer =
            signed_distance(part.shape, part_pose(part, body.pose), ground, 0.0);
        if (answer.status == QueryStatus::not_resident) deepest_part.resident = false;
        if (!answer.has_ground || -answer.distance <= deepest_part.depth) continue;
        deepest_part.depth = -answer.distance;
        deepest_part.normal = answer.normal;
    }
    return deepest_part;
}

bool is_outside(const Ground& ground, const WorldPos& point) {
    return !ground.extent().contains(point.x(), point.y()) ||
           ground.cell(ground.column_at(point.x()), ground.row_at(point.y())).status ==
               GroundStatus::outside;
}

double greatest_lift(const RigidBody& body, const Ground& ground) {
    double lift = 0.0;
    for (const BodyPart& part : body.parts) {
        const Pose pose = part_pose(part, body.pose);
        const LocalGround local(ground, pose.translation);
        const LocalBody there(part.shape, pose.rotation, local.to_local(pose.translation));
        lift = std::max(lift, find_lift(local, there, Eigen::Vector3d::Zero(), lift).lift);
    }
    return lift;
}

double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least) {
    if (lift <= at_least) return at_least;
    return std::max(at_least, compute_depth(body, ground).depth);
}

}  // namespace terrane::internal
