// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"

#include <limits>

namespace terrane::internal {

/// Where a shape that moves without turning meets a column.
struct ColumnEntry {
    double time = std::numeric_limits<double>::infinity();  ///< infinite: not before the limit
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column
};

/// First time of contact of a shape with a column, taken back until they are apart by a hair: the gap there is
/// between 0 and half of the tolerance.
///
/// @param velocity  metres in a unit of time
/// @param tolerance metres
/// @param ground_offset      how much lower the top of the column counts as, metres
/// @param from      a time up to which they are known to be apart
/// @param limit     contacts at this time and later are none
ColumnEntry find_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                       const Triangle& triangle, double tolerance, double ground_offset, double from,
                       double limit);

/// The same of a box.
ColumnEntry find_box_entry(const LocalShape& box, const Eigen::Vector3d& velocity,
                           const Triangle& triangle, double tolerance, double ground_offset, double limit);

}  // namespace terrane::internal
