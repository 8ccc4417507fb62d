// SPDX-License-Identifier: MIT
#include "pairs/pairs.h"

#include <algorithm>

namespace terrane::internal {

Gap find_gap(const PlacedSphere& a, const PlacedBox& b) {
    // In the box's frame.
    const Eigen::Vector3d centre = rotated_back(b.rotation, a.centre - b.centre);
    Eigen::Vector3d nearest = centre;
    for (int i = 0; i < 3; ++i) nearest[i] = std::clamp(centre[i], -b.half[i], b.half[i]);
    const Eigen::Vector3d d = centre - nearest;
    const double distance = length(d);
    Gap gap;
    gap.core_a = a.centre;
    gap.core_b = b.centre + rotated(b.rotation, nearest);
    if (distance > 0.0) {
        gap.distance = distance - a.radius;
        gap.normal = rotated(b.rotation, d / distance);
        return gap;
    }
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (b.half[i] - std::abs(centre[i]) < b.half[axis] - std::abs(centre[axis])) axis = i;
    }
    const double sign = centre[axis] < 0.0 ? -1.0 : 1.0;
    const double depth = b.half[axis] - std::abs(centre[axis]);
    gap.distance = -depth - a.radius;
    gap.normal = sign * b.rotation.col(axis);
    gap.core_b = a.centre + depth * gap.normal;
    return gap;
}

void find_contacts(const PlacedSphere& a, const PlacedBox& b, const Gap& gap, Manifold& manifold) {
    // The nearest feature of the box: the coordinates at their limits identify a face, an edge or a vertex.
    const Eigen::Vector3d on_b = rotated_back(b.rotation, gap.core_b - b.centre);
    const double slack = kTouchShare * (length(b.half) + a.radius);
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    std::uint32_t face = 0;
    int ends = 0;
    for (int i = 0; i < 3; ++i) {
        const bool is_high = on_b[i] >= b.half[i] - slack && on_b[i] >= 0.0;
        const bool is_low = on_b[i] <= -b.half[i] + slack && on_b[i] <= 0.0;
        const auto bit = std::uint32_t{1} << i;
        if (is_high) {
            low |= bit;
            high |= bit;
        } else if (!is_low) {
            high |= bit;
        }
        if (is_high || is_low) {
            ++ends;
            face = static_cast<std::uint32_t>(2 * i + (is_high ? 1 : 0));
        }
    }
    const ShapeFeature feature =
        ends <= 1 ? ShapeFeature{face, ShapeFeature::kFace} : ShapeFeature{low, high};
    manifold.add(a.centre - a.radius * gap.normal, -gap.distance, {0, 0}, feature);
}

bool is_touching(const PlacedSphere& a, const PlacedBox& b) {
    return find_gap(a, b).distance <= kTouchShare * (length(b.half) + a.radius);
}

Axis find_pseudodistance(const PlacedSphere& a, const PlacedBox& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, gap.distance};
}

}  // namespace terrane::internal
