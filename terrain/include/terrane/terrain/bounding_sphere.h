// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// A ball that contains a body or an object, closed.
struct BoundingSphere {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< world, metres
    double radius = 0.0;                               ///< metres, >= 0
};

}  // namespace terrane
