// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/lift/ground_lift.h"

namespace terrane::internal {

/// The nearest points of a free shape and the ground.
struct Nearest {
    bool is_found = false;  ///< within the distance that was asked for
    double distance = 0.0;
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    bool is_missing = false;
    double error_m = 0.0;
};

/// Of all parts of a body. Requires that it is not in the ground.
Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance);

/// Distance of a shape from a triangle that it does not cross.
ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle);

}  // namespace terrane::internal
