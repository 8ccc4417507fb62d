// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core_gap.h"

// Every pair of convex shapes has these four functions. a comes before b in the order sphere, capsule, box, hull.
//
//   find_gap             signed distance, normal, nearest points
//   find_contacts        adds contacts to a manifold with the gap's normal
//   is_touching          whether the gap is at most `touch_of`, at lower cost
//   find_pseudodistance  see shape_pairs.h
namespace terrane::internal {

#define TERRANE_PAIR(A, B)                                                          \
    Gap find_gap(const A& a, const B& b);                                           \
    void find_contacts(const A& a, const B& b, const Gap& gap, Manifold& manifold); \
    bool is_touching(const A& a, const B& b);                                       \
    Axis find_pseudodistance(const A& a, const B& b);

TERRANE_PAIR(PlacedSphere, PlacedSphere)
TERRANE_PAIR(PlacedSphere, PlacedCapsule)
TERRANE_PAIR(PlacedSphere, PlacedBox)
TERRANE_PAIR(PlacedSphere, PlacedHull)
TERRANE_PAIR(PlacedCapsule, PlacedCapsule)
TERRANE_PAIR(PlacedCapsule, PlacedBox)
TERRANE_PAIR(PlacedCapsule, PlacedHull)
TERRANE_PAIR(PlacedBox, PlacedBox)
TERRANE_PAIR(PlacedBox, PlacedHull)
TERRANE_PAIR(PlacedHull, PlacedHull)

#undef TERRANE_PAIR

/// Pseudodistance of two sphere-swept cores: (d^2 - R^2) / (2 R) for the distance d of the cores and the sum R of the
/// radii, or d where R is 0.
inline double swept_pseudodistance(double core_distance, double radii) {
    if (radii == 0.0) return core_distance;
    return (core_distance - radii) * ((core_distance + radii) / (2.0 * radii));
}

}  // namespace terrane::internal
