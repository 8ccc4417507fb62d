// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/manifold.h"
#include "pairs/kernels/separating_axis.h"

// The queries for any two cores, by GJK and the separating axis search. Pairs with closed forms do not use these.
namespace terrane::internal {

/// The signature of find_separating_axis(); box_box has a faster one.
using AxisFinder = Axis (*)(const Core& a, const Core& b, double enough);

Gap find_core_gap(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// Whether the gap is at most touch_of(a, b), at lower cost.
bool is_core_touching(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// Pseudodistance of two polyhedra without radii.
Axis find_polyhedra_pseudodistance(const Core& a, const Core& b,
                                   AxisFinder find_axis = find_separating_axis);

}  // namespace terrane::internal
