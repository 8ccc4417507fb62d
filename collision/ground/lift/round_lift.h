// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/ground_window.h"
#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

namespace terrane::internal {

/// Lift of a sphere or capsule over the cells of a range inside a window. Lifts up to `floor` need not be found; any
/// lift above `enough` may be returned.
WindowLift find_round_lift(const LocalGround& local, const GroundWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough);

}  // namespace terrane::internal
