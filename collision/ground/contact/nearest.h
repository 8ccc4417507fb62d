// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/lift/ground_lift.h"

namespace terrane::internal {

/// The closest point of a separated shape to the ground.
struct Nearest {
    bool is_found = false;  ///< within the largest distance
    double distance = 0.0;  ///< metres
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from the ground to the shape
    bool is_missing = false;                            ///< a nearer cell is not resident
    double error_m = 0.0;
};

/// The nearest over all parts of a body. Requires that it is separated.
Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance);

/// Closest points of a shape and a triangle that do not intersect.
ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle);

}  // namespace terrane::internal
