// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/ground_window.h"
#include "ground/frame/local_shape.h"

namespace terrane::internal {

/// Largest of surface minus z over a box whose bounds lie within a window. Lifts at or below `floor` need
/// not be found, nor others where one is above `enough`.
///
/// @param corner  south-western corner of the window, in the frame of the box; z is not looked at
/// @param spacing of its cells, metres
WindowLift find_box_lift(const GroundWindow& window, const Eigen::Vector3d& corner, double spacing,
                         const LocalShape& box, double floor, double enough);

}  // namespace terrane::internal
