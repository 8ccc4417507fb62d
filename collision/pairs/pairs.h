// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core_gap.h"

// Every pair of shapes answers these four questions, each in the file of its name. a comes before b in the
// order sphere, capsule, box, hull. A pair that is not here does not compile.
//
//   find_gap             signed distance, normal, nearest points
//   find_contacts        into a manifold whose normal is the gap's
//   is_touching          the same as a gap of at most `touch_of`, found sooner
//   find_pseudodistance  as shape_pairs.h defines it
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

/// Of two sphere-swept cores: (d^2 - R^2) / (2 R), for the distance d of the cores and the sum R of the
/// radii; d where R is 0.
inline double swept_pseudodistance(double core_distance, double radii) {
    if (radii == 0.0) return core_distance;
    return (core_distance - radii) * ((core_distance + radii) / (2.0 * radii));
}

}  // namespace terrane::internal
