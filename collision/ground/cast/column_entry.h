// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"
#include "ground/lift/ground_lift.h"

#include <limits>

namespace terrane::internal {

/// Where a shape that translates meets a column.
struct ColumnEntry {
    double time = std::numeric_limits<double>::infinity();  ///< infinity: not before the limit
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column
};

/// Whether a shape with this gap along a wall's normal touches the wall, which two columns may share: a shape without
/// thickness that moves along it is inside the ground, although it overlaps neither column. So a wall that is touched
/// separates only what moves away from it.
inline bool is_touching_wall(double gap) { return gap >= 0.0 && gap <= kTouch; }

/// First time of contact of a shape with a column, moved back slightly: the gap there is between 0 and half the
/// tolerance.
///
/// @param velocity      metres per unit of time
/// @param tolerance     metres
/// @param ground_offset the top of the column counts as lower by this, metres
/// @param from          they are known to be apart until this time
/// @param limit         contacts at this time or later are ignored
ColumnEntry find_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                       const Triangle& triangle, double tolerance, double ground_offset,
                       double from, double limit);

/// The same for a box.
ColumnEntry find_box_entry(const LocalShape& box, const Eigen::Vector3d& velocity,
                           const Triangle& triangle, double tolerance, double ground_offset,
                           double limit);

}  // namespace terrane::internal
