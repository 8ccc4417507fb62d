// SPDX-License-Identifier: MIT
#include "pairs/convex_queries.h"

#include "pairs/pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

template <typename Shape>
constexpr int kOrder = 0;
template <>
constexpr int kOrder<PlacedCapsule> = 1;
template <>
constexpr int kOrder<PlacedBox> = 2;
template <>
constexpr int kOrder<PlacedHull> = 3;

// Calls f(first, second, is_swapped) with the shapes in the order of pairs.h.
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
        return PlacedCapsule{centre, capsule->half_height * rotation.col(2), capsule->radius};
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
        // The gap decides; the points' depths may differ from it by rounding.
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
