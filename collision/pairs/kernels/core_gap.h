// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/manifold.h"
#include "pairs/kernels/separating_axis.h"

// The questions, answered for any two cores. What a pair knows better it answers in its own file.
namespace terrane::internal {

/// What find_separating_axis() does; pairs may have a faster way.
using AxisFinder = Axis (*)(const Core& a, const Core& b, double enough);

Gap find_core_gap(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// The same as a gap that is at most the rounding of touching shapes, found sooner.
bool is_core_touching(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// Of two polyhedra without radii.
Axis find_polyhedra_pseudodistance(const Core& a, const Core& b,
                                   AxisFinder find_axis = find_separating_axis);

}  // namespace terrane::internal
