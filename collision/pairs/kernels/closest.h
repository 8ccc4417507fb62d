// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"

#include <limits>

namespace terrane::internal {

/// Nearest points of two cores, without their radii.
struct Closest {
    Eigen::Vector3d on_a;
    Eigen::Vector3d on_b;
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< from b to a; arbitrary where they overlap
    double distance = 0.0;         ///< between the two points; 0 where the cores overlap
    double lower = 0.0;            ///< lower bound of the distance, certified by a separating plane
};

/// GJK.
/// @param enough stops once the distance is known to be larger than this
Closest find_closest(const Core& a, const Core& b,
                     double enough = std::numeric_limits<double>::infinity());

/// Nearest points p + s u and q + t v of the segments p to p + u and q to q + v; s and t are 0 to 1.
struct SegmentPair {
    double s = 0.0;
    double t = 0.0;
};
SegmentPair find_closest_on_segments(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& q, const Eigen::Vector3d& v);

}  // namespace terrane::internal
