// SPDX-License-Identifier: MIT
#include "ground/column/hull_column.h"

#include "pairs/kernels/closest.h"

namespace terrane::internal {
namespace {

// Closest points of a hull and the convex hull of some points, which are relative to `origin`.
ClosestPair find_closest_to(const LocalHull& hull, const Eigen::Vector3d& centre,
                            const Eigen::Vector3d& origin,
                            std::span<const Eigen::Vector3d> points) {
    const Core a = make_core(hull, centre - origin);
    Core b;
    b.shape.vertices = points;
    b.rotation = Eigen::Matrix3d::Identity();
    b.centre = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) b.reach = std::max(b.reach, length(p));
    const Closest closest = find_closest(a, b);
    return {closest.on_a + origin, closest.on_b + origin, closest.distance};
}

}  // namespace

Core make_core(const LocalHull& hull, const Eigen::Vector3d& centre) {
    Core core;
    core.shape = *hull.shape;
    core.rotation = hull.rotation;
    core.centre = centre - hull.middle;
    core.reach = length(hull.middle) + length(hull.bounds);
    return core;
}

ClosestPair find_closest_hull(const LocalHull& hull, const Eigen::Vector3d& centre,
                              const Triangle& triangle) {
    const Eigen::Vector3d& origin = triangle.v[0];
    const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d::Zero(), triangle.v[1] - origin,
                                                   triangle.v[2] - origin};
    return find_closest_to(hull, centre, origin, points);
}

ClosestPair find_closest_in_column(const LocalHull& hull, const Eigen::Vector3d& centre,
                                   const Triangle& triangle) {
    const Eigen::Vector3d& origin = triangle.v[0];
    std::array<Eigen::Vector3d, 6> points;
    double low = centre[2] - hull.bounds[2] - origin[2];
    for (std::size_t i = 0; i < 3; ++i) {
        points[i] = triangle.v[i] - origin;
        low = std::min(low, points[i][2]);
    }
    // The prism's bottom is placed low enough not to affect the closest points.
    low -= 1.0 + length(hull.bounds);
    for (std::size_t i = 0; i < 3; ++i) {
        points[i + 3] = points[i];
        points[i + 3][2] = low;
    }
    return find_closest_to(hull, centre, origin, points);
}

}  // namespace terrane::internal
