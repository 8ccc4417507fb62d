// SPDX-License-Identifier: MIT
#include <terrane/scene/bounds.h>

#include <cmath>

namespace terrane {
namespace {

// Relative rounding of sums of a few products, with a margin.
constexpr double kRounding = 0x1p-49;

}  // namespace

Aabb bounding_box(std::span<const Eigen::Vector3d> points) {
    if (points.empty()) return {};
    Aabb box = {points[0], points[0]};
    for (const Eigen::Vector3d& p : points) {
        box.low = box.low.cwiseMin(p);
        box.high = box.high.cwiseMax(p);
    }
    return box;
}

OrientedBox transform(const Pose& target_from_source, double scale, const Aabb& box_source) {
    const Eigen::Vector3d middle = 0.5 * (box_source.low + box_source.high);
    // Rounding of the middle is covered by the distances of both ends from it.
    const Eigen::Vector3d half =
        (box_source.high - middle).cwiseMax(middle - box_source.low) * (1.0 + kRounding);
    OrientedBox box;
    box.frame_from_box = {target_from_source.rotation,
                          target_from_source * Eigen::Vector3d(scale * middle)};
    box.half_extents = scale * half;
    return box;
}

Aabb bounding_box(const OrientedBox& box) {
    const Pose& pose = box.frame_from_box;
    const Eigen::Vector3d reach = pose.rotation.cwiseAbs() * box.half_extents;
    const Eigen::Vector3d outward = reach + kRounding * (reach + pose.translation.cwiseAbs());
    return {pose.translation - outward, pose.translation + outward};
}

BoundingSphere bounding_sphere(const OrientedBox& box) {
    return {box.frame_from_box.translation, box.half_extents.norm() * (1.0 + kRounding)};
}

}  // namespace terrane
