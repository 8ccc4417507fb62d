// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/ground_window.h"
#include "ground/frame/local_shape.h"

namespace terrane::internal {

/// Lift of a box whose bounds lie within a window. Lifts up to `floor` need not be found; any lift above `enough` may
/// be returned.
///
/// @param corner  south-western corner of the window, in the frame of the box; z is not used
/// @param spacing of the window's cells, metres
WindowLift find_box_lift(const GroundWindow& window, const Eigen::Vector3d& corner, double spacing,
                         const LocalShape& box, double floor, double enough);

}  // namespace terrane::internal
