// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// An axis-aligned bounding box, closed, metres, in the axes of whatever it is given for.
struct Aabb {
    Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< lowest coordinate along each axis
    Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< highest, >= low
};

}  // namespace terrane
