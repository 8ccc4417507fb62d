// SPDX-License-Identifier: MIT
// What a character touches, and its moves onto steps.
#include "character/character_parts.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

/// Feet stand on contacts with gaps up to this beyond the rest gap, in tolerances.
constexpr double kStandingGap = 1.0 / 8.0;
constexpr std::size_t kMaxContactsOfBody = 24;
constexpr std::size_t kMaxBodies = 32;  // that it touches at once

QueryFilter filter_of(const RigidBody& body, BodyId self) {
    return {.layers = body.filter.collides_with,
            .except = self,
            .include_sensors = false,
            .include_ground = false};
}

}  // namespace

/// Finds the contacts with the ground and with bodies at the body's pose.
void Character::find_contacts(const RigidBody& body, const Scene& scene) {
    contacts_.clear();
    cache_.invalidate();
    cache_.update(body, *scene.query.ground);
    if (!cache_.is_resident()) return;
    for (std::size_t i = 0; i < cache_.count(); ++i) {
        contacts_.push_back({cache_.contact(i, body, 0), BodyId::kNone});
    }
    const double margin = kContactMargin * body.tolerance;
    const Capsule wider{settings_.radius + margin, settings_.half_height};
    std::array<BodyId, kMaxBodies> near;
    const OverlapQueryAnswer answer =
        query_overlaps(scene.query, wider, body.pose, filter_of(body, scene.self), near);
    std::array<PairContact, kMaxContactsOfBody> found;
    for (std::size_t i = 0; i < answer.count; ++i) {
        const QueryBody& other = scene.query.bodies[near[i].index];
        const PairContactAnswer contacts = terrane::find_contacts(
            *body.shape, body.pose, *other.shape, other.world_from_shape, margin, found);
        for (std::size_t k = 0; k < contacts.count; ++k) {
            SolverContact contact;
            contact.point_a = found[k].point_world;
            contact.normal = found[k].normal;
            contact.rounding = settings_.radius;
            contact.gap = -found[k].depth;
            contact.rest_gap = kRestGap * body.tolerance;
            contacts_.push_back({contact, near[i].index});
        }
    }
}

/// Largest gap of a contact that feet stand on, metres.
double Character::standing_gap(const RigidBody& body) {
    return (kRestGap + kStandingGap) * body.tolerance;
}

/// The flattest contact that it stands on; null in the air.
const Character::FootContact* Character::find_support(const RigidBody& body) const {
    const FootContact* support = nullptr;
    for (const FootContact& each : contacts_) {
        const SolverContact& contact = each.contact;
        if (contact.normal.z() < feet_.least_cosine || contact.gap > standing_gap(body)) continue;
        if (support == nullptr || contact.normal.z() > support->contact.normal.z()) {
            support = &each;
        }
    }
    return support;
}

/// Whether a contact that is too steep to stand on is ahead.
bool Character::is_blocked(const RigidBody& body, const Eigen::Vector3d& direction) const {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const FootContact& each) {
        const SolverContact& contact = each.contact;
        return contact.normal.z() < feet_.least_cosine && dot(contact.normal, direction) < 0.0 &&
               contact.gap <= standing_gap(body);
    });
}

/// Moves the capsule by a displacement, or until bodies or the ground stop it.
MoveAnswer Character::move(RigidBody& body, const Scene& scene,
                           const Eigen::Vector3d& displacement) {
    const Motion motion{body.pose, displacement, Eigen::Vector3d::Zero()};
    const CastQueryAnswer met =
        query_cast(scene.query, *body.shape, motion, filter_of(body, scene.self));
    const double fraction = met.hit ? met.fraction : 1.0;
    cache_.invalidate();
    MoveAnswer answer = move_body(body, cache_, *scene.query.ground,
                                  {fraction * displacement, Eigen::Vector3d::Zero()});
    answer.fraction *= fraction;
    return answer;
}

/// Finds the height of a step up that leads onto something higher that can be stood on. False where there is none.
/// Leaves the body where it was.
bool Character::find_step(RigidBody& body, const Scene& scene, const Eigen::Vector3d& forward) {
    const BodyMotion before = body;
    const Eigen::Vector3d up(0.0, 0.0, settings_.max_step);
    const double highest = before.pose.translation.z() - settings_.radius - settings_.half_height +
                           settings_.max_step + body.tolerance;
    const double rise = move(body, scene, up).fraction;
    move(body, scene, forward);
    find_contacts(body, scene);
    // If the lower cap hit an edge, move back until the cylindrical side is flush with it, then step down.
    double back = 0.0;
    for (const FootContact& each : contacts_) {
        const Eigen::Vector3d& n = each.contact.normal;
        if (dot(n, forward) >= 0.0) continue;
        const double level = std::sqrt(n.x() * n.x() + n.y() * n.y());
        back = std::max(back, settings_.radius * (1.0 - level) + body.tolerance);
    }
    if (back > 0.0) move(body, scene, forward * (-back / length(forward)));
    const double fall = move(body, scene, -rise * up).fraction;
    find_contacts(body, scene);
    const bool is_higher = body.pose.translation.z() > before.pose.translation.z() + body.tolerance;
    const FootContact* const support = find_support(body);
    const bool could =
        fall < 1.0 && is_higher && support != nullptr && support->contact.point_a.z() <= highest;
    if (could) step_height_ = body.pose.translation.z();
    static_cast<BodyMotion&>(body) = before;
    return could;
}

}  // namespace terrane::internal
