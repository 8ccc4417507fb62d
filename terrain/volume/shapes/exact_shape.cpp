// SPDX-License-Identifier: MIT
// Signed distances by formula. Sources: C. Ericson. Real-Time Collision Detection. 2005, sections 5.1.2 (segment) and
// 5.1.4 (box).
#include "shapes/exact_shape.h"

namespace terrane::internal {
namespace {

CapsulePart make_capsule(const Eigen::Vector3d& from_world, const Eigen::Vector3d& to_world,
                         double radius) {
    const Eigen::Vector3d along = to_world - from_world;
    const double square = dot(along, along);
    return {from_world, along, square > 0.0 ? 1.0 / square : 0.0, radius};
}

Eigen::Vector3d to_place(const Pose& pose, const Eigen::Vector3d& p_shape) {
    return rotated(pose.rotation, p_shape) + pose.translation;
}

}  // namespace

double signed_distance(const CapsulePart& part, const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p = p_world - part.from_world;
    const double t = std::clamp(dot(p, part.along) * part.inverse_square, 0.0, 1.0);
    const Eigen::Vector3d off = p - t * part.along;
    return std::sqrt(dot(off, off)) - part.radius;
}

double signed_distance(const BoxPart& part, const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p = rotated_back(part.world_from_box, p_world - part.centre_world);
    Eigen::Vector3d beyond;
    double largest = -std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double excess = std::abs(p[axis]) - part.half_extents[axis];
        largest = std::max(largest, excess);
        beyond[axis] = std::max(excess, 0.0);
    }
    return largest <= 0.0 ? largest : std::sqrt(dot(beyond, beyond));
}

ExactShape ExactShape::place(const VolumeOperation& operation) {
    const Pose& pose = operation.world_from_shape;
    ExactShape shape;
    if (const auto* sphere = std::get_if<VolumeSphere>(&operation.shape)) {
        shape.capsules.push_back(make_capsule(pose.translation, pose.translation, sphere->radius));
    } else if (const auto* capsule = std::get_if<VolumeCapsule>(&operation.shape)) {
        const Eigen::Vector3d end(0.0, 0.0, capsule->half_height);
        shape.capsules.push_back(
            make_capsule(to_place(pose, -end), to_place(pose, end), capsule->radius));
    } else if (const auto* box = std::get_if<VolumeBox>(&operation.shape)) {
        shape.boxes.push_back({pose.rotation, pose.translation, box->half_extents});
    } else if (const auto* tube = std::get_if<VolumeTube>(&operation.shape)) {
        const std::size_t count = tube->path_shape.size();
        for (std::size_t i = 0; i < std::max<std::size_t>(count - 1, 1); ++i) {
            shape.capsules.push_back(make_capsule(
                to_place(pose, tube->path_shape[i]),
                to_place(pose, tube->path_shape[std::min(i + 1, count - 1)]), tube->radius));
        }
    }
    return shape;
}

Aabb ExactShape::bounds() const {
    Aabb box = empty_box();
    for (const CapsulePart& part : capsules) {
        include(part.from_world, part.radius, box);
        include(part.from_world + part.along, part.radius, box);
    }
    for (const BoxPart& part : boxes) {
        for (int corner = 0; corner < 8; ++corner) {
            const Eigen::Vector3d& half = part.half_extents;
            const Eigen::Vector3d offset((corner & 1) != 0 ? half[0] : -half[0],
                                         (corner & 2) != 0 ? half[1] : -half[1],
                                         (corner & 4) != 0 ? half[2] : -half[2]);
            include(part.centre_world + rotated(part.world_from_box, offset), 0.0, box);
        }
    }
    return box;
}

double ExactShape::thickness() const {
    return boxes.empty() ? 2.0 * capsules.front().radius
                         : 2.0 * boxes.front().half_extents.minCoeff();
}

double ExactShape::signed_distance(const Eigen::Vector3d& p_world) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t part = 0; part < part_count(); ++part) {
        least = std::min(least, part_distance(part, p_world));
    }
    return least;
}

}  // namespace terrane::internal
