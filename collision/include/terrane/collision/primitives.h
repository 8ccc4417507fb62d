// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// Sphere around the origin of the body frame. Shapes are closed sets; lengths are metres.
struct Sphere {
    double radius = 0.5;
};

/// Everything within `radius` of the segment from (0, 0, -half_height) to (0, 0, half_height).
struct Capsule {
    double radius = 0.4;
    double half_height = 0.8;
};

/// Box around the origin, along the axes of the body frame.
struct Box {
    Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.5);
};

}  // namespace terrane
