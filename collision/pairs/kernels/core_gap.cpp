// SPDX-License-Identifier: MIT
#include "pairs/kernels/core_gap.h"

#include "base/vector_math.h"
#include "pairs/kernels/closest.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Distances as shares of the sizes and the offset: below the first, nearest points give an inaccurate normal; below the
// second, none; below the third, GJK does not tell separated cores from overlapping ones.
constexpr double kNear = 1e-7;
constexpr double kTiny = 1e-9;
constexpr double kNothing = 1e-14;

// A direction orthogonal to cores that are points or collinear segments.
Eigen::Vector3d any_square_direction(const Core& a, const Core& b) {
    for (const Core* core : {&a, &b}) {
        if (core->shape.edges.empty()) continue;
        const Polyhedron::Edge& edge = core->shape.edges[0];
        const Eigen::Vector3d along =
            core->to_axes(core->shape.vertices[edge.to] - core->shape.vertices[edge.from]);
        const double size = length(along);
        if (size > 0.0) return any_tangent(along / size);
    }
    return Eigen::Vector3d::UnitZ();
}

}  // namespace

Gap find_core_gap(const Core& a, const Core& b, AxisFinder find_axis) {
    const double radii = a.radius + b.radius;
    const double scale = a.reach + b.reach + length(a.centre - b.centre);
    const Closest closest = find_closest(a, b);
    Gap gap;
    gap.distance = closest.distance - radii;
    gap.normal = closest.normal;
    gap.core_a = closest.on_a;
    gap.core_b = closest.on_b;
    if (closest.lower > kNear * scale) return gap;

    const Axis axis = find_axis(a, b, kInfinity);
    const bool is_apart = closest.lower > kNothing * scale;
    if (axis.gap == -kInfinity) {
        if (!is_apart) gap.normal = any_square_direction(a, b);
        return gap;
    }
    const bool is_rounding = closest.distance < kTiny * scale;
    if (is_apart && !is_rounding && axis.gap < (1.0 - 1e-6) * closest.distance) return gap;
    gap.normal = axis.normal;
    gap.has_points = closest.distance > 0.0 && axis.gap > 0.0;
    gap.distance = gap.has_points ? std::max(closest.distance, axis.gap)
                                  : std::min(axis.gap, gap_along(a, b, axis.normal));
    // The axis may be worse by up to the touching distance than the certified lower bound.
    if (is_apart) gap.distance = std::max(gap.distance, closest.lower);
    gap.distance -= radii;
    return gap;
}

bool is_core_touching(const Core& a, const Core& b, AxisFinder find_axis) {
    const double touch = touch_of(a, b);
    const double radii = a.radius + b.radius;
    const Closest closest = find_closest(a, b, radii + touch);
    if (closest.lower > radii + touch) return false;
    if (radii > touch || closest.distance == 0.0) return closest.distance <= radii + touch;
    return find_core_gap(a, b, find_axis).distance <= touch;
}

Axis find_polyhedra_pseudodistance(const Core& a, const Core& b, AxisFinder find_axis) {
    const Axis axis = find_axis(a, b, kInfinity);
    const double touch = touch_of(a, b);
    if (axis.gap > touch || (axis.gap < -touch && axis.gap > -kInfinity)) return axis;
    // The Minkowski difference of flat shapes may be flat; its boundary has no facet.
    const Closest closest = find_closest(a, b);
    if (closest.lower > touch) return {closest.normal, closest.distance};
    return axis.gap > -kInfinity ? axis : Axis{any_square_direction(a, b), 0.0};
}

}  // namespace terrane::internal
