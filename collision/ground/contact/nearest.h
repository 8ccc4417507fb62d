// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/closest_points.h"
#include "ground/contact/contact_patches.h"
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
    std::uint32_t part = 0;  ///< of a compound; else 0
    Triangle triangle;       ///< that it is closest to
};

/// The nearest over all parts of a body. Requires that it is separated.
Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance);

/// Adds the nearest points of a separated body as a contact, if they are within the margin and not at the ground's
/// border. False where a cell in reach is not resident.
///
/// The pairs of features leave out an edge of the shape over a vertex of the ground, and a vertex over an edge or a
/// vertex: next to touching, the features beside them have the same contacts, but over a gap they may be all that is
/// near. Those of round shapes are complete.
bool add_nearest(const LocalGround& local, const LocalBody& body, double margin,
                 ContactPatches& patches);

/// Closest points of a shape and a triangle that do not intersect.
ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle);

}  // namespace terrane::internal
