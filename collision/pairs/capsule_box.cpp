// SPDX-License-Identifier: MIT
#include "pairs/pairs.h"

namespace terrane::internal {

Gap find_gap(const PlacedCapsule& a, const PlacedBox& b) {
    CoreStorage of_a;
    CoreStorage of_b;
    return find_core_gap(make_core(a, of_a), make_core(b, of_b));
}

void find_contacts(const PlacedCapsule& a, const PlacedBox& b, const Gap& gap, Manifold& manifold) {
    CoreStorage of_a;
    CoreStorage of_b;
    find_core_contacts(make_core(a, of_a), make_core(b, of_b), gap, manifold);
}

bool is_touching(const PlacedCapsule& a, const PlacedBox& b) {
    CoreStorage of_a;
    CoreStorage of_b;
    return is_core_touching(make_core(a, of_a), make_core(b, of_b));
}

Axis find_pseudodistance(const PlacedCapsule& a, const PlacedBox& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, gap.distance};
}

}  // namespace terrane::internal
