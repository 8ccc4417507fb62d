// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/terrain/aabb.h>

#include <algorithm>

namespace terrane::internal {

/// The empty box, from +infinity to -infinity; include() makes it the box around points.
inline Aabb empty_box() {
    return {Eigen::Vector3d::Constant(kInfinity), Eigen::Vector3d::Constant(-kInfinity)};
}

/// Extends a box to contain a ball.
inline void include(const Eigen::Vector3d& centre, double radius, Aabb& box) {
    for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], centre[axis] - radius);
        box.high[axis] = std::max(box.high[axis], centre[axis] + radius);
    }
}

/// Whether two boxes, each widened by a margin, overlap or touch: the exact test of all broadphases. Without branches,
/// because most of the boxes that are compared are near each other and either may be.
inline bool overlap(const Aabb& a, const Aabb& b, double margin) {
    const double both = 2.0 * margin;
    int is = 1;
    for (int i = 0; i < 3; ++i) {
        is &= static_cast<int>(a.low[i] - b.high[i] <= both) &
              static_cast<int>(b.low[i] - a.high[i] <= both);
    }
    return is != 0;
}

}  // namespace terrane::internal
