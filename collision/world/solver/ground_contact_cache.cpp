// SPDX-License-Identifier: MIT
//
// Sources:    Ericson. Real-Time Collision Detection. 2005, section 9.5 (lowering instead of inflating).
// Deviations: instead of lowering the surface by L, the cast shape is raised by L. A body that does not penetrate the
//             surface lowered by L is separated by moving it up by L, so its penetration depth is at most L. Near
//             volumes the body is shrunk instead, which is also valid below ceilings and next to walls: the shrunk body
//             never touches a triangle, so no overlap along a normal exceeds the offset.
#include "world/solver/ground_contact_cache.h"

#include "ground/column/ground_lift.h"
#include "ground/heightfield/contact_patches.h"
#include "ground/heightfield/heightfield_queries.h"
#include "ground/joined_queries.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace terrane::internal {

namespace {

constexpr double kOffsetRatio = 0.85;
constexpr std::array<double, kOffsetCount> make_offset_depths() {
    std::array<double, kOffsetCount> depths{};
    double left = 1.0 - kFirstOffset;
    for (double& depth : depths) {
        depth = 1.0 - left;
        left *= kOffsetRatio;
    }
    return depths;
}
constexpr std::array<double, kOffsetCount> kOffsetDepths = make_offset_depths();
/// Reuse distance, in tolerances: if a body has moved farther, contacts are found anew.
constexpr double kReuseDistance = 1.0 / 32.0;
/// Contacts are reused only if the smallest gap at the refresh was at least this, in tolerances. Ground for which no
/// contact was found was then at least as far away, and has come nearer by at most the reuse distance.
constexpr double kReusableGap = 1.0 / 8.0;
/// Least cosine of the angle between the normals of the same contact in two refreshes.
constexpr double kSameNormal = 0.95;
/// Largest component difference of normals that count as unchanged.
constexpr double kSameDirection = 1e-9;
/// Share of a gap that a body may cross without a cast.
constexpr double kClearShare = 0.5;
/// Bodies over more cells than this along an axis are always cast.
constexpr double kMaxCells = 8.0;

/// Whether all cells below and above a body, widened by a margin, are ground. The body can then only touch the surface
/// that the refresh examined, not the side of the ground.
bool has_ground_around(const RigidBody& body, const Ground& ground, double margin) {
    const double around = body.tolerance + margin;
    if (!(2.0 * (body.radius + around) < kMaxCells * ground.spacing())) return false;
    return GroundReader(ground).is_all_ground(cells_around(body, ground, around));
}

/// Friction and restitution of a body on the ground: combined as for two bodies if the ground has a surface map, else
/// the body's own.
SurfaceProperties combined_surface(const RigidBody& body, std::uint32_t part, const Ground& ground,
                                   double x, double y) {
    SurfaceProperties combined{.friction = friction_of(body, part),
                               .restitution = body.restitution};
    if (const std::optional<SurfaceProperties> surface = ground.surface(x, y)) {
        combined.friction = combined_friction(combined.friction, surface->friction);
        combined.restitution = combined_restitution(body.restitution, surface->restitution);
    }
    return combined;
}

}  // namespace

double offset_depth(const RigidBody& body, int offset_index) {
    return body.tolerance * kOffsetDepths[static_cast<std::size_t>(offset_index)];
}

CellRange cells_around(const RigidBody& body, const Ground& ground, double margin) {
    const double reach = body.radius + margin;
    const WorldPos& centre = body.pose.translation;
    return {ground.column_at(centre.x() - reach), ground.row_at(centre.y() - reach),
            ground.column_at(centre.x() + reach), ground.row_at(centre.y() + reach)};
}

Pose raised(Pose pose, double height) {
    pose.translation.z() += height;
    return pose;
}

void GroundContactCache::update(const RigidBody& body, const Ground& ground, double travel) {
    if (is_reusable_) {
        moved_ = greatest_move(body, refresh_pose_, body.pose);
        if (moved_ < kReuseDistance * body.tolerance) {
            follow(body);
            return;
        }
    }
    refresh(body, ground, {.travel = travel});
}

void GroundContactCache::refresh(const RigidBody& body, const Ground& ground,
                                 const Search& search) {
    std::array<Contact, kMaxCount> found;
    std::swap(contacts_, previous_contacts_);
    contacts_.clear();
    resident_ = true;
    is_out_of_reach_ = false;
    is_exhaustive_ = false;
    is_reusable_ = false;
    is_same_ = true;
    lift_ = -1.0;
    moved_ = 0.0;
    refresh_pose_ = body.pose;
    offset_index_ = search.offset_index;
    margin_ = kContactMargin * body.tolerance + search.reach;
    const double offset = offset_depth(body, offset_index_);
    const Pose pose = raised(body.pose, offset);
    std::array<double, kMaxCount> openings;
    is_on_mesh_ = may_meet_volume(ground, body.pose.translation,
                                  body.radius + body.tolerance + margin_ + search.travel);
    const ContactAnswer answer =
        is_on_mesh_       ? find_on_mesh(body, ground, found, openings)
        : search.is_clear ? find_separated_contacts(*body.shape, pose, ground, margin_, found)
                          : columns::find_contacts(*body.shape, pose, ground, margin_, found);
    if (answer.status == QueryStatus::not_resident) {
        resident_ = false;
        return;
    }
    const bool is_complete = answer.status == QueryStatus::ok;
    lift_ = std::max(lift_, answer.lift);
    for (std::size_t i = 0; i < answer.count; ++i) {
        CachedContact contact;
        contact.feature = found[i].feature;
        contact.part = found[i].part;
        contact.normal = found[i].normal;
        const CachedContact* const before = find_previous(contact);
        contact.impulse = before != nullptr ? before->impulse : Eigen::Vector3d::Zero();
        is_same_ = is_same_ && before != nullptr &&
                   (before->normal - contact.normal).isZero(kSameDirection);
        contact.opening = is_on_mesh_ ? openings[i] : contact.normal.z();
        contact.gap = contact.refresh_gap =
            is_on_mesh_ ? contact.opening * offset - found[i].depth : -found[i].depth;
        contact.rounding = rounding_of(*body.shape, contact.part);
        contact.refresh_core = found[i].point_world + contact.rounding * contact.normal;
        if (!is_on_mesh_) contact.refresh_core.z() -= offset;
        contact.core_body =
            rotated_back(body.pose.rotation, contact.refresh_core - body.pose.translation);
        const SurfaceProperties surface = combined_surface(
            body, contact.part, ground, found[i].point_world.x(), found[i].point_world.y());
        contact.friction = surface.friction;
        contact.restitution = surface.restitution;
        contacts_.push_back(contact);
    }
    is_same_ = is_same_ && contacts_.size() == previous_contacts_.size();
    // False if contacts were truncated: an omitted contact may be nearer than one of another part that was kept.
    is_exhaustive_ = !is_on_mesh_ && is_complete && !contacts_.empty() &&
                     has_ground_around(body, ground, margin_);
    is_reusable_ = is_complete && offset_index_ == 0 && search.reach == 0.0 &&
                   least_gap(0.0, kReusableGap * body.tolerance) >= kReusableGap * body.tolerance;
    if (is_on_mesh_) {
        is_reusable_ = is_reusable_ && mesh_offset_.index == 0 &&
                       mesh_offset_.distance >= kReusableGap * body.tolerance;
    }
}

/// Finds the contacts near volumes at the first offset at which the shrunk body is clear. Finds none if no offset is.
ContactAnswer GroundContactCache::find_on_mesh(const RigidBody& body, const Ground& ground,
                                               std::span<Contact> contacts_out,
                                               std::span<double> openings_out) {
    const double clear = kStopGap * body.tolerance;
    const auto find_at = [&](int index) {
        MeshContactAnswer answer =
            find_contacts_at_offset(*body.shape, body.pose, ground, offset_depth(body, index),
                                    margin_, 2.0 * clear, contacts_out);
        std::copy_n(answer.openings.begin(), answer.contacts.count, openings_out.begin());
        mesh_offset_ = {answer.contacts.status == QueryStatus::not_resident, index,
                        answer.distance};
        return answer.contacts;
    };
    const ContactAnswer answer = find_at(offset_index_);
    if (mesh_offset_.is_missing || mesh_offset_.distance >= clear) return answer;
    const MeshOffset first = find_mesh_offset(body, ground, offset_index_);
    if (first.is_missing || first.index == kOffsetCount) {
        mesh_offset_ = first;
        return {.status = first.is_missing ? QueryStatus::not_resident : QueryStatus::ok};
    }
    return first.index == offset_index_ ? answer : find_at(first.index);
}

MeshOffset find_mesh_offset(const RigidBody& body, const Ground& ground, int from) {
    const double clear = kStopGap * body.tolerance;
    MeshOffset found;
    const auto distance_at = [&](int index) {
        const MeshNearness near = find_nearness_at(
            *body.shape, body.pose, ground, offset_depth(body, index), 2.0 * clear, 2.0 * clear);
        found.is_missing = found.is_missing || near.is_missing;
        return near.distance;
    };
    found.index = from;
    found.distance = distance_at(from);
    if (found.is_missing || found.distance >= clear) return found;
    // Shrunk bodies are nested, so clearance is monotonic in the offset: bisection.
    int deep = from;
    found.index = kOffsetCount - 1;
    found.distance = distance_at(found.index);
    if (!(found.distance > 0.0)) found.index = kOffsetCount;
    if (!(found.distance >= clear)) return found;
    while (found.index - deep > 1) {
        const int middle = (found.index + deep) / 2;
        const double distance = distance_at(middle);
        if (distance >= clear) {
            found.index = middle;
            found.distance = distance;
        } else {
            deep = middle;
        }
    }
    return found;
}

void GroundContactCache::set_out_of_reach() {
    contacts_.clear();
    offset_index_ = 0;
    resident_ = is_out_of_reach_ = true;
    is_exhaustive_ = is_reusable_ = is_same_ = is_on_mesh_ = false;
    lift_ = -1.0;
    moved_ = 0.0;
}

void GroundContactCache::reset() {
    contacts_.clear();
    previous_contacts_.clear();
    step_start_contacts_.clear();
    resident_ = true;
    is_reusable_ = is_same_ = is_out_of_reach_ = is_exhaustive_ = is_on_mesh_ = false;
    lift_ = -1.0;
    moved_ = margin_ = 0.0;
}

/// The contact of the same feature in the previous refresh, or null.
const GroundContactCache::CachedContact* GroundContactCache::find_previous(
    const CachedContact& contact) const {
    for (const CachedContact& old : previous_contacts_) {
        if (old.feature == contact.feature && old.part == contact.part &&
            dot(old.normal, contact.normal) > kSameNormal) {
            return &old;
        }
    }
    return nullptr;
}

void GroundContactCache::follow(const RigidBody& body) {
    for (CachedContact& contact : contacts_) {
        const Eigen::Vector3d core =
            rotated(body.pose.rotation, contact.core_body) + body.pose.translation;
        contact.gap = contact.refresh_gap + dot(contact.normal, core - contact.refresh_core);
    }
}

double GroundContactCache::least_gap(double extra_offset, double limit) const {
    double least = limit;
    for (const CachedContact& contact : contacts_) {
        least = std::min(least, contact.opening * extra_offset + contact.gap);
    }
    return least;
}

bool GroundContactCache::is_near(const RigidBody& body) const {
    const double margin = kContactMargin * body.tolerance;
    return has_contacts() && least_gap(0.0, 2.0 * margin) <= margin;
}

double GroundContactCache::clear_distance(double extra_offset) const {
    if (is_out_of_reach_) return std::numeric_limits<double>::infinity();
    if (is_on_mesh_) {
        return mesh_offset_.index < kOffsetCount ? kClearShare * mesh_offset_.distance - moved_
                                                 : 0.0;
    }
    if (!is_exhaustive_) return 0.0;
    return kClearShare * least_gap(extra_offset, margin_) - moved_;
}

// Lowering the surface decreases the lift by exactly the same distance, so that one contact query serves all surfaces.
std::optional<OffsetSurface> GroundContactCache::highest_clear_surface(
    const RigidBody& body) const {
    if (is_on_mesh_) {
        if (mesh_offset_.index == kOffsetCount) return std::nullopt;
        return surface(body, mesh_offset_.index);
    }
    const double clear = kStopGap * body.tolerance;
    for (int index = 0; index < kOffsetCount; ++index) {
        const double extra_offset = offset_depth(body, index) - offset_depth(body, 0);
        if (lift() > extra_offset) continue;
        // The gap must be at least `clear`, except at the last surface or if the next one is less than 2 * clear lower.
        if (index + 1 == kOffsetCount || least_gap(extra_offset, clear) >= clear ||
            offset_depth(body, index + 1) - offset_depth(body, index) < 2.0 * clear) {
            return surface(body, index);
        }
    }
    return std::nullopt;
}

OffsetSurface GroundContactCache::surface(const RigidBody& body, int index) const {
    if (is_on_mesh_) {
        const MeshOffset now{false, std::min(std::max(index, mesh_offset_.index), kOffsetCount - 1),
                             mesh_offset_.distance - moved_};
        return {now.index, true, now.stop_gap(body.tolerance), clear_distance(0.0)};
    }
    const double extra_offset = offset_depth(body, index) - offset_depth(body, offset_index_);
    const double gap = least_gap(extra_offset, 2.0 * kStopGap * body.tolerance);
    return {index, false, std::max(kLeastStopGap, 0.5 * gap), clear_distance(extra_offset)};
}

SolverContact GroundContactCache::contact(std::size_t i, const RigidBody& body,
                                          std::uint32_t index) const {
    const CachedContact& cached = contacts_[i];
    SolverContact contact;
    contact.a = index;
    contact.normal = cached.normal;
    contact.point_a = rotated(body.pose.rotation, cached.core_body) + body.pose.translation -
                      cached.rounding * cached.normal;
    contact.rounding = cached.rounding;
    contact.gap = cached.gap;
    contact.rest_gap = kRestGap * body.tolerance;
    contact.target_gap = kSeparationGap * body.tolerance;
    contact.initial_impulse = cached.impulse;
    contact.friction = cached.friction;
    contact.restitution = cached.restitution;
    return contact;
}

}  // namespace terrane::internal
