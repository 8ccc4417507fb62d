// SPDX-License-Identifier: MIT
#include "../local_shape.h"
#include "../shapes/hull_data.h"
#include "pair_questions.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>

namespace terrane {

using namespace internal;

namespace {

ConvexView view_of(const ConvexShape& shape) {
    if (const ConvexHull* hull = std::get_if<ConvexHull>(&shape)) {
        return HullView{polyhedron(*hull), bounding_radius(*hull)};
    }
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return *sphere;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) return *capsule;
    return std::get<Box>(shape);
}

bool is_usable(const ConvexShape& shape, const Pose& pose) {
    if (std::holds_alternative<ConvexHull>(shape)) return internal::is_usable(Sphere{}, pose);
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        return internal::is_usable(*sphere, pose);
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return internal::is_usable(*capsule, pose);
    }
    return internal::is_usable(std::get<Box>(shape), pose);
}

// Two shapes in world axes around a's place.
struct PlacedPair {
    PlacedPair(const ConvexShape& shape_a, const Pose& world_from_a, const ConvexShape& shape_b,
               const Pose& world_from_b)
        : is_valid(is_usable(shape_a, world_from_a) && is_usable(shape_b, world_from_b)) {
        if (!is_valid) return;
        const ConvexView view_a = view_of(shape_a);
        const ConvexView view_b = view_of(shape_b);
        offset = world_from_b.translation - world_from_a.translation;
        reach = reach_of(view_a) + reach_of(view_b);
        a = place(view_a, orthonormalized(world_from_a.rotation), Eigen::Vector3d::Zero());
        b = place(view_b, orthonormalized(world_from_b.rotation), offset);
    }

    /// Whether the shapes are farther apart than this, by their bounding spheres.
    bool is_beyond(double distance) const {
        const double far = (reach + distance) * (1.0 + 4.0 * kTouchShare);
        return dot(offset, offset) > far * far;
    }

    bool is_valid;
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< of b's place
    double reach = 0.0;                                ///< of both bounding spheres
    Placed a;
    Placed b;
};

}  // namespace

PairTestAnswer test_contact(const ConvexShape& a, const Pose& world_from_a, const ConvexShape& b,
                            const Pose& world_from_b) {
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid) return {};
    return {ContactStatus::complete, !pair.is_beyond(0.0) && is_touching(pair.a, pair.b)};
}

PairContactAnswer find_contacts(const ConvexShape& a, const Pose& world_from_a,
                                const ConvexShape& b, const Pose& world_from_b, double margin,
                                std::span<PairContact> contacts_out) {
    PairContactAnswer answer;
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid || !(margin >= 0.0)) return answer;
    answer.status = ContactStatus::complete;
    if (pair.is_beyond(margin)) return answer;
    const Gap gap = find_gap(pair.a, pair.b);
    const double reported = std::max(margin, kTouchShare * pair.reach);
    std::array<PairContact, 4> found;
    const std::size_t count = find_contacts(pair.a, pair.b, gap, reported, found);
    if (count > contacts_out.size()) answer.status = ContactStatus::truncated;
    answer.count = std::min(count, contacts_out.size());
    for (std::size_t i = 0; i < answer.count; ++i) {
        contacts_out[i] = found[i];
        contacts_out[i].point_world += world_from_a.translation;
    }
    return answer;
}

PairDistanceAnswer signed_distance(const ConvexShape& a, const Pose& world_from_a,
                                   const ConvexShape& b, const Pose& world_from_b) {
    PairDistanceAnswer answer;
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid) return answer;
    const Gap gap = find_gap(pair.a, pair.b);
    answer.status = ContactStatus::complete;
    answer.distance = gap.distance;
    answer.normal = gap.normal;
    find_witnesses(pair.a, pair.b, gap, answer.point_a_world, answer.point_b_world);
    answer.point_a_world += world_from_a.translation;
    answer.point_b_world += world_from_a.translation;
    return answer;
}

PseudodistanceAnswer pseudodistance(const ConvexShape& a, const Pose& world_from_a,
                                    const ConvexShape& b, const Pose& world_from_b) {
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid) return {};
    const Axis axis = find_pseudodistance(pair.a, pair.b);
    return {ContactStatus::complete, axis.gap, axis.normal};
}

PairCastAnswer cast(const ConvexShape& a, const Motion& motion_a, const ConvexShape& b,
                    const Motion& motion_b, const CastSettings& settings) {
    PairCastAnswer answer;
    if (!is_usable(a, motion_a.start) || !is_usable(b, motion_b.start) ||
        !is_finite(motion_a.translation) || !is_finite(motion_a.rotation_vector) ||
        !is_finite(motion_b.translation) || !is_finite(motion_b.rotation_vector) ||
        !(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance)) {
        return answer;
    }
    const ConvexCast found = cast_convex(view_of(a), motion_a, view_of(b), motion_b, settings);
    answer.status = ContactStatus::complete;
    answer.hit = found.hit;
    answer.fraction = found.fraction;
    answer.started_in_contact = found.started_in_contact;
    answer.count = found.count;
    answer.contacts = found.contacts;
    const Eigen::Vector3d place_of_a =
        motion_a.start.translation + found.fraction * motion_a.translation;
    for (PairContact& contact : std::span(answer.contacts.data(), answer.count)) {
        contact.point_world += place_of_a;
    }
    return answer;
}

ShapeRayAnswer cast_ray(const ConvexShape& shape, const Pose& world_from_shape,
                        const WorldPos& from, const WorldPos& to) {
    ShapeRayAnswer answer;
    if (!is_usable(shape, world_from_shape) || !is_finite(from) || !is_finite(to)) return answer;
    answer.status = ContactStatus::complete;
    const Placed placed =
        place(view_of(shape), orthonormalized(world_from_shape.rotation), Eigen::Vector3d::Zero());
    const Eigen::Vector3d way = to - from;
    const ConvexRay ray = internal::cast_ray(placed, from - world_from_shape.translation, way);
    answer.hit = ray.hit;
    answer.fraction = ray.hit ? ray.fraction : 1.0;
    answer.normal = ray.normal;
    answer.point_world = from + answer.fraction * way;
    return answer;
}

}  // namespace terrane
