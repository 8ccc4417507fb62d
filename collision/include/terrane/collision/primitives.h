// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// Sphere around the origin of the body frame. Shapes are closed sets; lengths are metres.
struct Sphere {
    double radius = 0.5;  ///< metres, >= 0
};

/// Everything within `radius` of the segment from (0, 0, -half_height) to (0, 0, half_height).
struct Capsule {
    double radius = 0.4;       ///< metres, >= 0
    double half_height = 0.8;  ///< from the centre to the middle of a cap, metres, >= 0
};

/// Box around the origin, along the axes of the body frame.
struct Box {
    /// Along x, y, z, metres, >= 0.
    Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.5);
};

}  // namespace terrane
