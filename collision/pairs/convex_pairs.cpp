// SPDX-License-Identifier: MIT
#include "pairs/convex_pairs.h"

#include "base/vector_math.h"
#include "pairs/convex_core.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Distances relative to the sizes and the offset: below kNear the nearest points give an inaccurate normal; below kTiny
// they give none; below kNothing GJK cannot distinguish separated from overlapping cores.
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
    // The gap of the axis may be up to the touching distance below the certified lower bound.
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
    // The Minkowski difference of flat shapes may itself be flat and have no facet.
    const Closest closest = find_closest(a, b);
    if (closest.lower > touch) return {closest.normal, closest.distance};
    return axis.gap > -kInfinity ? axis : Axis{any_square_direction(a, b), 0.0};
}

// Pairs without a closed form: GJK and the separating axis search.

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

namespace {

template <typename Shape>
constexpr int kOrder = 0;
template <>
constexpr int kOrder<PlacedCapsule> = 1;
template <>
constexpr int kOrder<PlacedBox> = 2;
template <>
constexpr int kOrder<PlacedHull> = 3;

// Calls f(first, second, is_swapped) with the shapes in the order of convex_pairs.h.
template <typename F>
auto in_order(const PlacedConvex& a, const PlacedConvex& b, const F& f) {
    return std::visit(
        [&](const auto& x, const auto& y) {
            if constexpr (kOrder<std::decay_t<decltype(x)>> <= kOrder<std::decay_t<decltype(y)>>) {
                return f(x, y, false);
            } else {
                return f(y, x, true);
            }
        },
        a, b);
}

// The same gap seen from the other shape.
Gap flipped(const Gap& gap) {
    Gap other = gap;
    other.normal = -gap.normal;
    other.core_a = gap.core_b;
    other.core_b = gap.core_a;
    return other;
}

double size_of(const PlacedSphere& sphere) { return sphere.radius; }
double size_of(const PlacedCapsule& capsule) { return capsule.radius + length(capsule.half_axis); }
double size_of(const PlacedBox& box) { return length(box.half); }
double size_of(const PlacedHull& hull) { return hull.reach; }

double radius_of(const PlacedConvex& shape) {
    if (const PlacedSphere* sphere = std::get_if<PlacedSphere>(&shape)) return sphere->radius;
    if (const PlacedCapsule* capsule = std::get_if<PlacedCapsule>(&shape)) return capsule->radius;
    return 0.0;
}

}  // namespace

PlacedConvex place(const ConvexView& shape, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& centre) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        return PlacedSphere{centre, sphere->radius};
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return PlacedCapsule{centre, capsule->half_height * rotation.col(2), capsule->radius,
                             capsule->half_height};
    }
    if (const Box* box = std::get_if<Box>(&shape)) {
        return PlacedBox{centre, rotation, box->half_extents};
    }
    const HullView& hull = std::get<HullView>(shape);
    return PlacedHull{centre, rotation, hull.shape, hull.reach};
}

double reach_of(const ConvexView& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return capsule->radius + capsule->half_height;
    }
    if (const Box* box = std::get_if<Box>(&shape)) return length(box->half_extents);
    return std::get<HullView>(shape).reach;
}

Gap find_gap(const PlacedConvex& a, const PlacedConvex& b) {
    return in_order(a, b, [](const auto& x, const auto& y, bool is_swapped) {
        return is_swapped ? flipped(find_gap(x, y)) : find_gap(x, y);
    });
}

bool is_touching(const PlacedConvex& a, const PlacedConvex& b) {
    return in_order(a, b, [](const auto& x, const auto& y, bool) { return is_touching(x, y); });
}

Axis find_pseudodistance(const PlacedConvex& a, const PlacedConvex& b) {
    return in_order(a, b, [](const auto& x, const auto& y, bool is_swapped) {
        Axis axis = find_pseudodistance(x, y);
        if (is_swapped) axis.normal = -axis.normal;
        return axis;
    });
}

std::size_t find_contacts(const PlacedConvex& a, const PlacedConvex& b, const Gap& gap,
                          double margin, std::array<PairContact, 4>& contacts_out) {
    if (!(gap.distance <= margin)) return 0;
    return in_order(a, b, [&](const auto& x, const auto& y, bool is_swapped) {
        const Gap own = is_swapped ? flipped(gap) : gap;
        // The gap decides whether there are contacts; the depths of the points may differ from it by rounding.
        Manifold manifold(own.normal, margin + kTouchShare * (size_of(x) + size_of(y)));
        find_contacts(x, y, own, manifold);
        const std::size_t count = manifold.finish(contacts_out);
        if (is_swapped) {
            for (PairContact& contact : std::span(contacts_out.data(), count)) {
                contact.point_world += contact.depth * contact.normal;
                contact.normal = -contact.normal;
                std::swap(contact.feature_a, contact.feature_b);
            }
        }
        return count;
    });
}

void find_witnesses(const PlacedConvex& a, const PlacedConvex& b, const Gap& gap,
                    Eigen::Vector3d& on_a_out, Eigen::Vector3d& on_b_out) {
    if (gap.has_points) {
        on_a_out = gap.core_a - radius_of(a) * gap.normal;
        on_b_out = gap.core_b + radius_of(b) * gap.normal;
        return;
    }
    std::array<PairContact, 4> contacts;
    find_contacts(a, b, gap, std::numeric_limits<double>::infinity(), contacts);
    on_a_out = contacts[0].point_world;
    on_b_out = on_a_out + contacts[0].depth * contacts[0].normal;
}

}  // namespace terrane::internal
