// SPDX-License-Identifier: MIT
#include "pairs/pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Position of the core's point nearest to the sphere, in half axes from the centre: -1 to 1.
double find_share(const PlacedSphere& a, const PlacedCapsule& b) {
    const double square = dot(b.half_axis, b.half_axis);
    if (square == 0.0) return 0.0;
    return std::clamp(dot(a.centre - b.centre, b.half_axis) / square, -1.0, 1.0);
}

}  // namespace

Gap find_gap(const PlacedSphere& a, const PlacedCapsule& b) {
    Gap gap;
    gap.core_a = a.centre;
    gap.core_b = b.centre + find_share(a, b) * b.half_axis;
    const Eigen::Vector3d d = gap.core_a - gap.core_b;
    const double distance = length(d);
    gap.distance = distance - (a.radius + b.radius);
    const double size = length(b.half_axis);
    if (distance > 0.0) {
        gap.normal = d / distance;
    } else if (size > 0.0) {
        gap.normal = any_tangent(b.half_axis / size);
    }
    return gap;
}

void find_contacts(const PlacedSphere& a, const PlacedCapsule& b, const Gap& gap,
                   Manifold& manifold) {
    const double share = find_share(a, b);
    const ShapeFeature feature = share <= -1.0  ? ShapeFeature{0, 0}
                                 : share >= 1.0 ? ShapeFeature{1, 1}
                                                : ShapeFeature{0, 1};
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, feature);
}

bool is_touching(const PlacedSphere& a, const PlacedCapsule& b) {
    return find_gap(a, b).distance <= kTouchShare * (a.radius + b.radius + length(b.half_axis));
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedCapsule& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, swept_pseudodistance(length(gap.core_a - gap.core_b), a.radius + b.radius)};
}

}  // namespace terrane::internal
