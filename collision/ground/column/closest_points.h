// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

namespace terrane::internal {

struct LocalShape;

/// The closest points of a shape and a triangle. Where they intersect the distance is 0 and the points are arbitrary.
struct ClosestPair {
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d on_triangle = Eigen::Vector3d::Zero();
    double distance = 0.0;
};

/// Parameters of the closest points of two segments p + s u and q + t v, in [0, 1].
struct SegmentParameters {
    double s = 0.0;
    double t = 0.0;
};

/// Closest points of the segments p to p + u and q to q + v; v must not be zero, u may be. Any closest pair where they
/// are parallel.
SegmentParameters find_closest_parameters(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                          const Eigen::Vector3d& q, const Eigen::Vector3d& v);

/// The point of a triangle that is closest to p.
Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Triangle& triangle);

/// Closest points of the segment centre +- core and a triangle.
ClosestPair find_closest_core(const Eigen::Vector3d& centre, const Eigen::Vector3d& core,
                              const Triangle& triangle);

/// Closest points of a box and a triangle that do not intersect.
ClosestPair find_closest_box(const LocalShape& box, const Triangle& triangle);

}  // namespace terrane::internal
