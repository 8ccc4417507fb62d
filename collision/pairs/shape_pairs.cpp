// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "pairs/compound_pairs.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>

namespace terrane {

using namespace internal;

namespace {

// Two shapes in world axes, relative to a's origin.
struct PlacedPair {
    /// @param most_distance shapes farther apart are not placed, see `is_beyond`
    PlacedPair(const Shape& shape_a, const Pose& world_from_a, const Shape& shape_b,
               const Pose& world_from_b, double most_distance = kInfinity)
        : is_valid(is_valid_query(shape_a, world_from_a) && is_valid_query(shape_b, world_from_b)) {
        if (!is_valid) return;
        reach = bounding_radius(shape_a) + bounding_radius(shape_b);
        const Eigen::Vector3d between = world_from_b.translation - world_from_a.translation;
        const double far = (reach + most_distance) * (1.0 + 4.0 * kTouchShare);
        is_beyond = dot(between, between) > far * far;
        if (is_beyond) return;
        view_a = ShapeView(shape_a);
        view_b = ShapeView(shape_b);
        is_single = view_a.is_single() && view_b.is_single();
        a = {&view_a, world_from_a.rotation, Eigen::Vector3d::Zero()};
        b = {&view_b, world_from_b.rotation, between};
        if (is_single && std::holds_alternative<Sphere>(shape_a) &&
            std::holds_alternative<Sphere>(shape_b)) {
            return;  // rotating a sphere changes nothing
        }
        a.rotation = orthonormalized(a.rotation);
        b.rotation = orthonormalized(b.rotation);
        if (!is_single) {
            view_a.find_bounds();
            view_b.find_bounds();
        }
    }
    PlacedPair(const PlacedPair&) = delete;
    PlacedPair& operator=(const PlacedPair&) = delete;

    /// Distance up to which the shapes touch, metres.
    double touch() const { return kTouchShare * reach; }

    bool is_valid;
    bool is_beyond = false;  ///< bounding spheres farther apart than `most_distance`
    ShapeView view_a;
    ShapeView view_b;
    bool is_single = true;  ///< both shapes have one part
    double reach = 0.0;     ///< sum of the radii of both bounding spheres
    PlacedView a;
    PlacedView b;
};

// Fills in the answer for overlapping compounds; the witness points are those after the separating translation.
void fill_overlap(const PlacedPair& pair, const SeparatingTranslation& separation,
                  PairDistanceAnswer& answer) {
    const double depth = length(separation.translation);
    const PlacedView separated = pair.a.moved(separation.translation);
    const PartGap last = find_least_gap(separated, pair.b);
    answer.distance = -depth;
    answer.normal = separation.translation / depth;
    answer.part_a = last.part_a;
    answer.part_b = last.part_b;
    find_witnesses(separated.part(last.part_a), pair.b.part(last.part_b), last.gap,
                   answer.point_a_world, answer.point_b_world);
    answer.point_a_world = answer.point_b_world - separation.translation;
}

}  // namespace

TestAnswer test_contact(const Shape& a, const Pose& world_from_a, const Shape& b,
                        const Pose& world_from_b) {
    const PlacedPair pair(a, world_from_a, b, world_from_b, 0.0);
    if (!pair.is_valid) return {};
    TestAnswer answer{QueryStatus::ok, false, 0.0};
    if (pair.is_beyond) return answer;
    if (pair.is_single) {
        answer.is_touching = is_touching(pair.a.part(0), pair.b.part(0));
        return answer;
    }
    visit_part_pairs(pair.view_a.tree(), pair.view_b.tree(), pair.touch(),
                     BoundGaps(pair.a, pair.b), [&](std::uint32_t i, std::uint32_t j, double) {
                         answer.is_touching = is_touching(pair.a.part(i), pair.b.part(j));
                         return answer.is_touching ? -std::numeric_limits<double>::infinity()
                                                   : pair.touch();
                     });
    return answer;
}

PairContactAnswer find_contacts(const Shape& a, const Pose& world_from_a, const Shape& b,
                                const Pose& world_from_b, double margin,
                                std::span<PairContact> contacts_out) {
    PairContactAnswer answer;
    const PlacedPair pair(a, world_from_a, b, world_from_b, margin);
    if (!pair.is_valid || !(margin >= 0.0)) return answer;
    answer.status = QueryStatus::ok;
    if (pair.is_beyond) {
        answer.least_distance =
            length(world_from_b.translation - world_from_a.translation) - pair.reach - pair.touch();
        return answer;
    }
    if (pair.is_single) {
        const PlacedConvex part_a = pair.a.part(0);
        const PlacedConvex part_b = pair.b.part(0);
        std::array<PairContact, 4> found;
        const Gap gap = find_gap(part_a, part_b);
        const std::size_t count =
            find_contacts(part_a, part_b, gap, std::max(margin, pair.touch()), found);
        if (count == 0) answer.least_distance = gap.distance - pair.touch();
        if (count > contacts_out.size()) answer.status = QueryStatus::truncated;
        answer.count = std::min(count, contacts_out.size());
        std::copy_n(found.begin(), answer.count, contacts_out.begin());
    } else {
        const CompoundContacts found =
            find_compound_contacts(pair.a, pair.b, margin, pair.touch(), contacts_out);
        if (found.is_truncated) answer.status = QueryStatus::truncated;
        answer.count = found.count;
    }
    for (PairContact& contact : contacts_out.first(answer.count)) {
        contact.point_world += world_from_a.translation;
    }
    return answer;
}

PairDistanceAnswer signed_distance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                   const Pose& world_from_b) {
    PairDistanceAnswer answer;
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid) return answer;
    answer.status = QueryStatus::ok;
    const PartGap least = pair.is_single ? PartGap{0, 0, find_gap(pair.a.part(0), pair.b.part(0))}
                                         : find_least_gap(pair.a, pair.b);
    if (pair.is_single || least.gap.distance >= -pair.touch()) {
        answer.distance = least.gap.distance;
        answer.normal = least.gap.normal;
        answer.part_a = least.part_a;
        answer.part_b = least.part_b;
        find_witnesses(pair.a.part(least.part_a), pair.b.part(least.part_b), least.gap,
                       answer.point_a_world, answer.point_b_world);
    } else {
        fill_overlap(pair, find_separating_translation(pair.a, pair.b, least, pair.touch()),
                     answer);
    }
    answer.point_a_world += world_from_a.translation;
    answer.point_b_world += world_from_a.translation;
    return answer;
}

PseudodistanceAnswer pseudodistance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                    const Pose& world_from_b) {
    const PlacedPair pair(a, world_from_a, b, world_from_b);
    if (!pair.is_valid) return {};
    Axis least;
    if (pair.is_single) {
        least = find_pseudodistance(pair.a.part(0), pair.b.part(0));
        return {QueryStatus::ok, least.gap, least.normal, 0.0};
    }
    least.gap = kInfinity;
    visit_part_pairs(pair.view_a.tree(), pair.view_b.tree(), kInfinity, BoundGaps(pair.a, pair.b),
                     [&](std::uint32_t i, std::uint32_t j, double bound) {
                         Axis axis = find_pseudodistance(pair.a.part(i), pair.b.part(j));
                         axis.gap = std::max(axis.gap, bound);
                         if (axis.gap < least.gap) least = axis;
                         return least.gap;
                     });
    return {QueryStatus::ok, least.gap, least.normal, 0.0};
}

PairCastAnswer cast(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
                    const CastSettings& settings) {
    PairCastAnswer answer;
    if (!is_valid_query(a, motion_a) || !is_valid_query(b, motion_b) ||
        !(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance)) {
        return answer;
    }
    answer.status = QueryStatus::ok;
    ShapeView view_a(a);
    ShapeView view_b(b);
    Motion moving_a = motion_a;
    Motion moving_b = motion_b;
    moving_a.start.rotation = orthonormalized(motion_a.start.rotation);
    moving_b.start.rotation = orthonormalized(motion_b.start.rotation);
    if (view_a.is_single() && view_b.is_single()) {
        const ConvexCast found =
            cast_convex({view_a.part(0), view_a.body_from_part(0), moving_a},
                        {view_b.part(0), view_b.body_from_part(0), moving_b}, 0.0, 1.0, settings);
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
    view_a.find_bounds();
    view_b.find_bounds();
    const CompoundCast found = cast_compounds(view_a, moving_a, view_b, moving_b, settings);
    answer.hit = found.hit;
    answer.fraction = found.fraction;
    answer.started_in_contact = found.started_in_contact;
    if (!found.hit) return answer;
    const double t = found.fraction;
    const PlacedView at_a{&view_a, moving_a.at(t).rotation, t * motion_a.translation};
    const PlacedView at_b{
        &view_b, moving_b.at(t).rotation,
        (motion_b.start.translation - motion_a.start.translation) + t * motion_b.translation};
    const double touch = kTouchShare * (view_a.reach() + view_b.reach());
    const double margin = std::max(settings.tolerance, find_least_gap(at_a, at_b).gap.distance);
    answer.count = find_compound_contacts(at_a, at_b, margin, touch, answer.contacts).count;
    for (PairContact& contact : std::span(answer.contacts.data(), answer.count)) {
        contact.point_world += motion_a.start.translation;
    }
    return answer;
}

ShapeRayAnswer cast_ray(const Shape& shape, const Pose& world_from_shape, const WorldPos& from,
                        const WorldPos& to) {
    ShapeRayAnswer answer;
    if (!is_valid_query(shape, world_from_shape) || !is_valid_place(from) || !is_valid_place(to)) {
        return answer;
    }
    answer.status = QueryStatus::ok;
    const ShapeView view(shape);
    const PlacedView placed{&view, orthonormalized(world_from_shape.rotation),
                            Eigen::Vector3d::Zero()};
    const Eigen::Vector3d displacement = to - from;
    const PartRay ray = cast_ray(placed, from - world_from_shape.translation, displacement);
    answer.hit = ray.hit;
    answer.fraction = ray.hit ? ray.fraction : 1.0;
    answer.normal = ray.normal;
    answer.part = ray.part;
    answer.point_world = from + answer.fraction * displacement;
    return answer;
}

}  // namespace terrane
