// SPDX-License-Identifier: MIT
#include "ground/column/local_ground.h"
#include "ground/heightfield/contact_patches.h"
#include "ground/heightfield/heightfield_queries.h"
#include "ground/heightfield/min_translation.h"
#include "pairs/convex_core.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>

namespace terrane {
namespace internal {
namespace {

// Adds the half-spaces of contacts with a gap that would overlap after a translation by d. True if there are any.
bool add_met(std::span<const Contact> contacts, const Eigen::Vector3d& d, HalfSpaces& spaces) {
    const std::size_t before = spaces.count;
    for (const Contact& contact : contacts) {
        if (contact.depth > 0.0 || dot(contact.normal, d) >= contact.depth - kSeparatedLift)
            continue;
        spaces.add({contact.normal, contact.depth});
    }
    return spaces.count > before;
}

// Of the planes with a normal in the ground's normal cone that separate a column from a translated shape, finds the one
// of smallest depth. False if there is none: then the shape leaves the column through a wall inside the ground.
bool find_least(const LocalGround& local, const LocalShape& moved, const Triangle& triangle,
                const Eigen::Vector3d& translation, HalfSpace& least_out) {
    bool is_found = false;
    visit_tops(moved, triangle, [&](const Eigen::Vector3d& n, double gap) {
        const double depth = dot(n, translation) - gap;
        if (gap < -kTouch || (is_found && !(depth < least_out.depth))) return;
        if (!is_in_normal_cone(local, triangle, n)) return;
        least_out = {n, depth};
        is_found = true;
    });
    return is_found;
}

// The contact of a part with a plane, at the part's support point.
Contact make_plane_contact(const LocalShape& shape, std::uint32_t part, const HalfSpace& plane) {
    const DeepestPoint deepest = shape.deepest(plane.normal);
    return make_contact(deepest.point, plane.normal, plane.depth, deepest.feature, part);
}

// The shortest translation by at least the depth of each contact along its normal. False if it does not separate the
// body.
bool resolve(const LocalGround& local, const LocalBody& body, std::span<const Contact> contacts,
             Eigen::Vector3d& translation_out) {
    if (contacts.empty()) return false;
    HalfSpaces spaces;
    for (const Contact& contact : contacts) {
        if (contact.depth <= 0.0) break;
        if (spaces.count == HalfSpaces::kMost) return false;
        spaces.add({contact.normal, contact.depth});
    }
    return find_shortest(spaces, translation_out) &&
           !(find_lift(local, body, translation_out, 0.5 * kTouch).lift > 0.5 * kTouch);
}

// Adds contacts until the shortest translation that resolves all of them separates the body. No added contact is deeper
// than `translation` along its normal, and each excludes the previous shortest translation.
void complete_patches(const LocalGround& local, const LocalBody& body, const GroundLift& lift,
                      const Eigen::Vector3d& translation, double margin, ContactPatches& patches) {
    constexpr int kRounds = 24;
    HalfSpaces spaces;
    for (const Contact& contact : patches.finish()) {
        if (contact.depth > 0.0) spaces.add({contact.normal, contact.depth});
    }
    LocalHull hull;
    std::uint32_t part = lift.part;
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Vector3d d;
        if (!find_shortest(spaces, d)) break;
        if (length(d - translation) <= 0.1 * kSeparatedLift) return;  // known to separate
        if (add_met(patches.finish(), d, spaces)) continue;
        const GroundLift rest = find_lift(local, body, d, 0.5 * kTouch);
        if (!(rest.lift > 0.5 * kTouch)) return;
        part = rest.part;
        const LocalShape shape = body.part(part, hull);
        LocalShape moved = shape;
        moved.centre += translation;
        HalfSpace least;
        if (!find_least(local, moved, rest.triangle, translation, least) || least.depth < -margin)
            break;
        patches.add(make_plane_contact(shape, part, least));
        spaces.add(least);
    }
    // Not converged: the separating translation becomes a contact. If the body's depth exceeds its size, it is moved up
    // instead, so that it does not leave the ground through the nearest side.
    constexpr double kLeastRise = 1e-9;  // smallest z of a normal
    const double depth = length(translation);
    HalfSpace last{Eigen::Vector3d::UnitZ(), lift.lift};
    if (depth > 2.0 * body.whole().bounds.maxCoeff()) {
        part = lift.part;
    } else {
        last = {translation / depth, depth};
        last.normal[2] = std::max(last.normal[2], kLeastRise);
    }
    const Contact separating = make_plane_contact(body.part(part, hull), part, last);
    patches.add(separating);
    // together with the other contacts it may lead elsewhere
    Eigen::Vector3d d;
    if (resolve(local, body, patches.finish(), d)) return;
    patches.clear();
    patches.add(separating);
}

// Whether a body is one round shape with its core above the ground.
//
// @param lift lift of the shape; the core's lift is less by at least the radius
bool is_core_above(const LocalGround& local, const LocalBody& body, double lift) {
    if (body.is_compound() || body.whole().kind != ShapeKind::round) return false;
    const LocalShape& shape = body.whole();
    if (lift < (1.0 - 1e-6) * shape.radius) return true;
    if (lift > 3.0 * shape.radius) return false;  // too steep for the test to pay off
    LocalShape core = shape;
    core.radius = 0.0;
    core.bounds -= Eigen::Vector3d::Constant(shape.radius);
    const GroundLift rest = find_lift(local, core, Eigen::Vector3d::Zero());
    return !rest.is_missing && rest.lift < -1e-6 * shape.radius;
}

// Finds all contacts of a body that overlaps the ground. False if a cell in reach is not resident.
bool find_overlap(const LocalGround& local, const LocalBody& body, const GroundLift& lift,
                  double margin, ContactPatches& patches, double& error_out) {
    // deep in rough ground the minimum is a search of milliseconds, which signed_distance() makes
    const double deep = kDeep * body.whole().smallest;  // 0 for flat shapes, which are never deep
    const bool is_deep = deep > 0.0 && lift.lift > deep;
    Eigen::Vector3d translation;
    if (is_core_above(local, body, lift.lift)) {
        if (!find_patches(local, body, Eigen::Vector3d::Zero(), margin, patches, error_out)) {
            return false;
        }
        const std::span<const Contact> contacts = patches.finish();
        if (resolve(local, body, contacts, translation) &&
            (is_deep || is_minimum(length(translation), contacts[0].depth)))
            return true;
        patches.clear();
    }
    translation = is_deep ? find_short_translation(local, body, lift.lift)
                          : find_min_translation(local, body, lift.lift).d;
    if (!find_patches(local, body, translation, margin, patches, error_out)) return false;
    complete_patches(local, body, lift, translation, margin, patches);
    return true;
}

// Writes the contacts found by a query. False if a cell in reach is not resident.
bool report(const LocalGround& local, const LocalBody& body, double margin, bool is_separated,
            ContactPatches& patches, std::span<Contact> contacts_out, ContactAnswer& answer_out) {
    std::span<const Contact> found = patches.finish();
    if (found.empty() && margin > 0.0 && is_separated) {
        if (!add_nearest(local, body, margin, patches)) return false;
        found = patches.finish();
    }
    answer_out.status =
        found.size() > contacts_out.size() ? QueryStatus::truncated : QueryStatus::ok;
    answer_out.count = std::min(found.size(), contacts_out.size());
    for (std::size_t i = 0; i < answer_out.count; ++i) {
        contacts_out[i] = found[i];
        contacts_out[i].point_world = local.to_world(found[i].point_world);
    }
    return true;
}

// The minimum translation. If the core of a round shape is above the ground, no translation shorter than the depth of a
// contact separates the shape from the ground at that contact, and the contacts often prove the minimum; otherwise by
// search.
MinTranslation compute_min_translation(const LocalGround& local, const LocalBody& body,
                                       double lift) {
    if (is_core_above(local, body, lift)) {
        ContactPatches patches;
        Eigen::Vector3d translation;
        double error_m = 0.0;
        if (find_patches(local, body, Eigen::Vector3d::Zero(), 0.0, patches, error_m)) {
            const std::span<const Contact> contacts = patches.finish();
            if (resolve(local, body, contacts, translation) &&
                is_minimum(length(translation), contacts[0].depth))
                return {translation, length(translation)};
        }
    }
    return find_min_translation(local, body, lift);
}

}  // namespace

ContactAnswer find_separated_contacts(const Shape& shape, const Pose& world_from_shape,
                                      const Ground& ground, double margin,
                                      std::span<Contact> contacts_out) {
    ContactAnswer answer;
    if (!is_valid_query(shape, world_from_shape) || !(margin >= 0.0) || !std::isfinite(margin))
        return answer;
    const LocalQuery query(shape, world_from_shape, ground);
    const auto& [local, body] = query;
    answer.lift = 0.0;
    ContactPatches patches;
    const bool is_known =
        find_patches(local, body, Eigen::Vector3d::Zero(), margin, patches, answer.error_m) &&
        report(local, body, margin, true, patches, contacts_out, answer);
    if (!is_known) answer.status = QueryStatus::not_resident;
    return answer;
}

namespace columns {

ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out) {
    ContactAnswer answer;
    if (!is_valid_query(shape, world_from_shape) || !(margin >= 0.0) || !std::isfinite(margin))
        return answer;
    const LocalQuery query(shape, world_from_shape, ground);
    const auto& [local, body] = query;
    // gaps beyond the margin need not be exact
    const GroundLift lift = query.lift(-margin - kTouch);
    answer.lift = lift.lift;
    answer.error_m = lift.error_m;
    answer.status = QueryStatus::not_resident;
    if (lift.is_missing) return answer;
    ContactPatches patches;
    const bool is_separated = lift.lift <= kSeparatedLift;
    const bool is_known =
        is_separated
            ? find_patches(local, body, Eigen::Vector3d::Zero(), margin, patches, answer.error_m)
            : find_overlap(local, body, lift, margin, patches, answer.error_m);
    if (!is_known || !report(local, body, margin, is_separated, patches, contacts_out, answer)) {
        answer.status = QueryStatus::not_resident;
    }
    return answer;
}

DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance) {
    DistanceAnswer answer;
    if (!is_valid_query(shape, world_from_shape) || !(max_distance >= 0.0)) return answer;
    const LocalQuery query(shape, world_from_shape, ground);
    const auto& [local, body] = query;
    const GroundLift lift = query.lift(-kTouch);
    answer.error_m = lift.error_m;
    answer.status = QueryStatus::not_resident;
    if (lift.is_missing) return answer;
    if (lift.lift > kSeparatedLift) {
        const MinTranslation found = compute_min_translation(local, body, lift.lift);
        const Eigen::Vector3d& translation = found.d;
        const double depth = length(translation);
        answer.distance_lower_bound = found.lower_bound;
        answer.status = QueryStatus::ok;
        answer.has_ground = true;
        answer.distance = -depth;
        answer.normal = translation / depth;
        const GroundLift after = find_lift(local, body, translation);
        if (after.is_missing) answer.status = QueryStatus::not_resident;
        // For a compound, the part that touches the ground after the translation.
        const std::uint32_t part = body.is_compound() ? after.part : 0;
        LocalHull hull;
        answer.point_world = local.to_world(body.part(part, hull).deepest_point(answer.normal));
        return answer;
    }
    const Nearest nearest = find_nearest(local, body, max_distance);
    answer.error_m = std::max(answer.error_m, nearest.error_m);
    if (nearest.is_missing) return answer;
    answer.status = QueryStatus::ok;
    answer.has_ground = nearest.is_found;
    answer.distance = nearest.is_found ? nearest.distance : max_distance;
    answer.distance_lower_bound = answer.distance;
    answer.point_world =
        nearest.is_found ? local.to_world(nearest.on_shape) : world_from_shape.translation;
    answer.normal = nearest.normal;
    return answer;
}

LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground) {
    LiftAnswer answer;
    if (!is_valid_query(shape, world_from_shape)) return answer;
    const GroundLift lift = LocalQuery(shape, world_from_shape, ground).lift();
    answer.status = lift.is_missing ? QueryStatus::not_resident : QueryStatus::ok;
    answer.lift = lift.lift;
    answer.error_m = lift.error_m;
    return answer;
}

TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground) {
    TestAnswer answer;
    if (!is_valid_query(shape, world_from_shape)) return answer;
    const GroundLift lift =
        LocalQuery(shape, world_from_shape, ground).lift(-2.0 * kTouch, -kTouch);
    answer.is_touching = lift.lift >= -kTouch;
    answer.status =
        lift.is_missing && !answer.is_touching ? QueryStatus::not_resident : QueryStatus::ok;
    answer.error_m = lift.error_m;
    return answer;
}

}  // namespace columns
}  // namespace internal
}  // namespace terrane
