// SPDX-License-Identifier: MIT
#include "pairs/pairs.h"

namespace terrane::internal {

Gap find_gap(const PlacedSphere& a, const PlacedSphere& b) {
    const Eigen::Vector3d d = a.centre - b.centre;
    const double distance = length(d);
    Gap gap;
    gap.distance = distance - (a.radius + b.radius);
    if (distance > 0.0) gap.normal = d / distance;
    gap.core_a = a.centre;
    gap.core_b = b.centre;
    return gap;
}

void find_contacts(const PlacedSphere& a, const PlacedSphere&, const Gap& gap, Manifold& manifold) {
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, {0, 0});
}

bool is_touching(const PlacedSphere& a, const PlacedSphere& b) {
    return find_gap(a, b).distance <= kTouchShare * (a.radius + b.radius);
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedSphere& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, swept_pseudodistance(length(a.centre - b.centre), a.radius + b.radius)};
}

}  // namespace terrane::internal
