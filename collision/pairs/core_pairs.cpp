// SPDX-License-Identifier: MIT
// The pairs without a closed form of their own: GJK and the separating axis search of pairs/kernels/core_gap.h.
#include "pairs/pairs.h"

namespace terrane::internal {
namespace {

/// The cores of two shapes and the storage that they point into.
struct CorePair {
    CorePair(const auto& shape_a, const auto& shape_b)
        : a(make_core(shape_a, storage_a)), b(make_core(shape_b, storage_b)) {}

    CoreStorage storage_a, storage_b;
    Core a, b;
};

Axis polyhedra_pseudodistance(const auto& a, const auto& b) {
    const CorePair cores(a, b);
    return find_polyhedra_pseudodistance(cores.a, cores.b);
}

Axis round_pseudodistance(const auto& a, const auto& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, gap.distance};
}

}  // namespace

#define TERRANE_CORE_PAIR(A, B, pseudodistance)                                      \
    Gap find_gap(const A& a, const B& b) {                                           \
        const CorePair cores(a, b);                                                  \
        return find_core_gap(cores.a, cores.b);                                      \
    }                                                                                \
    void find_contacts(const A& a, const B& b, const Gap& gap, Manifold& manifold) { \
        const CorePair cores(a, b);                                                  \
        find_core_contacts(cores.a, cores.b, gap, manifold);                         \
    }                                                                                \
    bool is_touching(const A& a, const B& b) {                                       \
        const CorePair cores(a, b);                                                  \
        return is_core_touching(cores.a, cores.b);                                   \
    }                                                                                \
    Axis find_pseudodistance(const A& a, const B& b) { return pseudodistance(a, b); }

TERRANE_CORE_PAIR(PlacedSphere, PlacedHull, round_pseudodistance)
TERRANE_CORE_PAIR(PlacedCapsule, PlacedBox, round_pseudodistance)
TERRANE_CORE_PAIR(PlacedCapsule, PlacedHull, round_pseudodistance)
TERRANE_CORE_PAIR(PlacedBox, PlacedHull, polyhedra_pseudodistance)
TERRANE_CORE_PAIR(PlacedHull, PlacedHull, polyhedra_pseudodistance)

#undef TERRANE_CORE_PAIR

}  // namespace terrane::internal
