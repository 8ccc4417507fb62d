// SPDX-License-Identifier: MIT
#include "contact_patches.h"
#include "freeing.h"
#include "half_spaces.h"
#include "nearest.h"

#include <terrane/collision/ground_contact.h>

#include <algorithm>

namespace terrane {
namespace internal {
namespace {

// Adds contacts until the shape is free after the shortest translation that resolves them all.
void complete_patches(const LocalGround& local, const LocalShape& shape, double lift,
                      ContactPatches& patches) {
    constexpr int kRounds = 8;
    HalfSpaces spaces;
    for (const Contact& contact : patches.finish()) {
        if (contact.depth > 0.0) spaces.add({contact.normal, contact.depth});
    }
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Vector3d d;
        if (find_shortest(spaces, d)) {
            const GroundLift rest = find_lift(local, shape, d, 0.5 * kTouch);
            if (!(rest.lift > 0.5 * kTouch)) return;
            if (round + 1 < kRounds) {
                Contact contact;
                contact.normal = rest.triangle.normal;
                contact.depth = -gap_along(contact.normal, shape, rest.triangle);
                contact.point_world = shape.deepest_point(contact.normal);
                patches.add(contact);
                spaces.add({contact.normal, contact.depth});
                continue;
            }
        }
        break;
    }
    // Straight up always frees.
    Contact contact;
    contact.depth = lift;
    contact.point_world = shape.deepest_point(contact.normal);
    patches.add(contact);
}

}  // namespace
}  // namespace internal

using namespace internal;

ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out) {
    ContactAnswer answer;
    if (!is_usable(shape, world_from_shape) || !(margin >= 0.0) || !std::isfinite(margin))
        return answer;
    const LocalGround local(ground, world_from_shape.translation);
    LocalShape shape_local = make_local_shape(shape, world_from_shape.rotation);
    shape_local.centre = local.to_local(world_from_shape.translation);

    // further apart than the margin nothing depends on how far
    const GroundLift lift =
        find_lift(local, shape_local, Eigen::Vector3d::Zero(), -margin - kTouch);
    answer.lift = lift.lift;
    answer.error_m = lift.error_m;
    answer.status = ContactStatus::not_resident;
    if (lift.is_missing) return answer;
    const Eigen::Vector3d freeing = lift.lift > kFree ? find_freeing(local, shape_local, lift.lift)
                                                      : Eigen::Vector3d(0.0, 0.0, 0.0);
    ContactPatches patches;
    if (!find_patches(local, shape_local, freeing, margin, patches, answer.error_m)) return answer;
    if (lift.lift > kFree) complete_patches(local, shape_local, lift.lift, patches);

    const std::span<const Contact> found = patches.finish();
    answer.status =
        found.size() > contacts_out.size() ? ContactStatus::truncated : ContactStatus::complete;
    answer.count = std::min(found.size(), contacts_out.size());
    for (std::size_t i = 0; i < answer.count; ++i) {
        contacts_out[i] = found[i];
        contacts_out[i].point_world = local.to_world(found[i].point_world);
    }
    return answer;
}

DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance) {
    DistanceAnswer answer;
    if (!is_usable(shape, world_from_shape) || !(max_distance >= 0.0)) return answer;
    const LocalGround local(ground, world_from_shape.translation);
    LocalShape shape_local = make_local_shape(shape, world_from_shape.rotation);
    shape_local.centre = local.to_local(world_from_shape.translation);

    const GroundLift lift = find_lift(local, shape_local, Eigen::Vector3d::Zero(), -kTouch);
    answer.error_m = lift.error_m;
    answer.status = ContactStatus::not_resident;
    if (lift.is_missing) return answer;
    if (lift.lift > kFree) {
        const Eigen::Vector3d freeing = find_freeing(local, shape_local, lift.lift);
        const double depth = length(freeing);
        answer.status = ContactStatus::complete;
        answer.has_ground = true;
        answer.distance = -depth;
        answer.normal = freeing / depth;
        answer.point_world = local.to_world(shape_local.deepest_point(answer.normal));
        return answer;
    }
    const Nearest nearest = find_nearest(local, shape_local, max_distance);
    answer.error_m = std::max(answer.error_m, nearest.error_m);
    if (nearest.is_missing) return answer;
    answer.status = ContactStatus::complete;
    answer.has_ground = nearest.is_found;
    answer.distance = nearest.is_found ? nearest.distance : max_distance;
    answer.point_world =
        nearest.is_found ? local.to_world(nearest.on_shape) : world_from_shape.translation;
    answer.normal = nearest.normal;
    return answer;
}

LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground) {
    LiftAnswer answer;
    if (!is_usable(shape, world_from_shape)) return answer;
    const LocalGround local(ground, world_from_shape.translation);
    LocalShape shape_local = make_local_shape(shape, world_from_shape.rotation);
    shape_local.centre = local.to_local(world_from_shape.translation);
    const GroundLift lift = find_lift(local, shape_local, Eigen::Vector3d::Zero());
    answer.status = lift.is_missing ? ContactStatus::not_resident : ContactStatus::complete;
    answer.lift = lift.lift;
    answer.error_m = lift.error_m;
    return answer;
}

}  // namespace terrane
