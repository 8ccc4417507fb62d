// SPDX-License-Identifier: MIT
// Sources: C. Ericson. Real-time collision detection. 2005, sections 4.2.3 to 4.2.6.
#include "world/queries/body_bounds.h"

#include "base/vector_math.h"
#include "pairs/kernels/core.h"
#include "shapes/compound_data.h"

#include <terrane/collision/motion.h>

namespace terrane::internal {
namespace {

// More than the distance up to which shapes touch, the errors of distances, and rounding.
double outward(const Shape& shape, const WorldPos& origin) {
    return 4.0 * kTouchShare * bounding_radius(shape) + 4e-15 * length(origin);
}

Aabb around(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
    return {centre - half, centre + half};
}

}  // namespace

Aabb compute_aabb(const Shape& shape, const Pose& world_from_shape) {
    const Eigen::Matrix3d rotation = orthonormalized(world_from_shape.rotation);
    const WorldPos& origin = world_from_shape.translation;
    const Eigen::Vector3d wider = Eigen::Vector3d::Constant(outward(shape, origin));
    if (const Compound* compound = std::get_if<Compound>(&shape)) {
        const Aabb& body = part_tree(*compound)[0].bounds;
        const Eigen::Vector3d half = rotated(rotation.cwiseAbs(), 0.5 * (body.high - body.low));
        return around(origin + rotated(rotation, 0.5 * (body.low + body.high)), half + wider);
    }
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d axis_body = rotation.row(axis).transpose();
        bounds.low[axis] = origin[axis] - support_distance(shape, -axis_body) - wider[axis];
        bounds.high[axis] = origin[axis] + support_distance(shape, axis_body) + wider[axis];
    }
    return bounds;
}

Aabb compute_rotating_aabb(const Shape& shape, const WorldPos& origin_world) {
    const double radius = bounding_radius(shape) + outward(shape, origin_world);
    return around(origin_world, Eigen::Vector3d::Constant(radius));
}

}  // namespace terrane::internal
