// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/ground_window.h"
#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

namespace terrane::internal {

/// The lift of a sphere or capsule over the cells of a range, none of them more than one cell from the end
/// of the window. Lifts at or below `floor` need not be found, nor others where one is above `enough`.
WindowLift find_round_lift(const LocalGround& local, const GroundWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough);

}  // namespace terrane::internal
