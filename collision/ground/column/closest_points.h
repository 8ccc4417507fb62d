// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

namespace terrane::internal {

struct LocalShape;

/// A pair of nearest points. Where the sets cross the distance is 0 and the points may be any.
struct ClosestPair {
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d on_triangle = Eigen::Vector3d::Zero();
    double distance = 0.0;
};

/// Nearest places of two segments, as shares of the ways.
struct SegmentParameters {
    double s = 0.0;
    double t = 0.0;
};

/// Of the segments p to p + u and q to q + v; v is none of 0. Where they are parallel any pair.
SegmentParameters find_closest_parameters(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                  const Eigen::Vector3d& q, const Eigen::Vector3d& v);

Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Triangle& triangle);

/// Between the segment centre +- core and a triangle.
ClosestPair find_closest_core(const Eigen::Vector3d& centre, const Eigen::Vector3d& core,
                              const Triangle& triangle);

/// Between a box and a triangle that do not cross.
ClosestPair find_closest_box(const LocalShape& box, const Triangle& triangle);

}  // namespace terrane::internal
