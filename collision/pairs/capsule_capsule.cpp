// SPDX-License-Identifier: MIT
#include "pairs/kernels/closest.h"
#include "pairs/pairs.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

ShapeFeature feature_at(double share) {
    if (share <= 0.0) return {0, 0};
    if (share >= 1.0) return {1, 1};
    return {0, 1};
}

}  // namespace

Gap find_gap(const PlacedCapsule& a, const PlacedCapsule& b) {
    const Eigen::Vector3d u = 2.0 * a.half_axis;
    const Eigen::Vector3d v = 2.0 * b.half_axis;
    const Eigen::Vector3d p = a.centre - a.half_axis;
    const Eigen::Vector3d q = b.centre - b.half_axis;
    const SegmentPair pair = find_closest_on_segments(p, u, q, v);
    Gap gap;
    gap.core_a = p + pair.s * u;
    gap.core_b = q + pair.t * v;
    const Eigen::Vector3d d = gap.core_a - gap.core_b;
    const double distance = length(d);
    gap.distance = distance - (a.radius + b.radius);
    const double size = length(u) + length(v);
    if (distance > 1e-14 * size) {
        gap.normal = d / distance;
        return gap;
    }
    // Crossing cores: any common perpendicular separates them.
    Eigen::Vector3d square = cross(u, v);
    const double sine = length(square);
    if (sine > 1e-10 * length(u) * length(v)) {
        square /= sine;
        gap.normal = dot(square, a.centre - b.centre) < 0.0 ? Eigen::Vector3d(-square) : square;
    } else if (size > 0.0) {
        const Eigen::Vector3d& longer = length(u) < length(v) ? v : u;
        gap.normal = any_tangent(longer / length(longer));
    }
    return gap;
}

void find_contacts(const PlacedCapsule& a, const PlacedCapsule& b, const Gap& gap,
                   Manifold& manifold) {
    const Eigen::Vector3d u = 2.0 * a.half_axis;
    const Eigen::Vector3d v = 2.0 * b.half_axis;
    const Eigen::Vector3d p = a.centre - a.half_axis;
    const Eigen::Vector3d q = b.centre - b.half_axis;
    const double radii = a.radius + b.radius;
    const double slack = kTouchShare * (radii + length(u) + length(v));
    // An end of one core above the other core: the height of the other's round surface decreases with the distance
    // beside its core.
    const auto add_end = [&](double s, double t, bool is_of_a) {
        const Eigen::Vector3d core_a = p + s * u;
        const Eigen::Vector3d d = core_a - (q + t * v);
        const double along = dot(gap.normal, d);
        const Eigen::Vector3d beside = d - along * gap.normal;
        const double other = is_of_a ? b.radius : a.radius;
        const double square = other * other - dot(beside, beside);
        if (square < -slack * slack) return;
        const double height = std::sqrt(std::max(0.0, square));
        const double reach_a = is_of_a ? a.radius : height;
        const double reach_b = is_of_a ? height : b.radius;
        Eigen::Vector3d on_a = core_a - reach_a * gap.normal;
        if (!is_of_a) on_a -= beside;
        manifold.add(on_a, reach_a + reach_b - along, feature_at(s), feature_at(t));
    };
    const double uu = dot(u, u);
    const double vv = dot(v, v);
    const SegmentPair pair = find_closest_on_segments(p, u, q, v);
    // Nearly parallel: the ends of the interval that the cores share, projected along the normal.
    const Eigen::Vector3d square = cross(u, v);
    constexpr double kParallel = 0.02;  // sine; ends that are too far apart fail the depth margin
    if (uu > 0.0 && vv > 0.0 && dot(square, square) < kParallel * kParallel * uu * vv) {
        for (const double end : {0.0, 1.0}) {
            if (const double t = dot(v, p + end * u - q) / vv; t >= 0.0 && t <= 1.0) {
                add_end(end, t, true);
            }
            if (const double s = dot(u, q + end * v - p) / uu; s >= 0.0 && s <= 1.0) {
                add_end(s, end, false);
            }
        }
    }
    if (!manifold.has_depth(-gap.distance - slack)) {
        manifold.add(p + pair.s * u - a.radius * gap.normal, -gap.distance, feature_at(pair.s),
                     feature_at(pair.t));
    }
}

bool is_touching(const PlacedCapsule& a, const PlacedCapsule& b) {
    return find_gap(a, b).distance <=
           kTouchShare * (a.radius + b.radius + length(a.half_axis) + length(b.half_axis));
}

Axis find_pseudodistance(const PlacedCapsule& a, const PlacedCapsule& b) {
    const Gap gap = find_gap(a, b);
    return {gap.normal, swept_pseudodistance(length(gap.core_a - gap.core_b), a.radius + b.radius)};
}

}  // namespace terrane::internal
