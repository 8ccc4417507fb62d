// SPDX-License-Identifier: MIT
#pragma once

#include "ground_window.h"
#include "local_shape.h"

#include <limits>

namespace terrane::internal {

/// The lift of a box over the cells of a window, and where it is.
struct BoxLift {
    double lift = -std::numeric_limits<double>::infinity();
    double x = 0.0, y = 0.0;  ///< in cells of the window
    int column = 0, row = 0;  ///< a cell that the place lies in or on
};

/// Largest of surface minus z over a box whose bounds lie within a window. Lifts at or below `floor` need
/// not be found.
///
/// @param corner  south-western corner of the window, in the frame of the box; z is not looked at
/// @param spacing of its cells, metres
BoxLift find_box_lift(const GroundWindow& window, const Eigen::Vector3d& corner, double spacing,
                      const LocalShape& box, double floor);

}  // namespace terrane::internal
