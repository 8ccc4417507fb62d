// SPDX-License-Identifier: MIT
#include "ground/column/ground_lift.h"
#include "ground/heightfield/contact_patches.h"
#include "ground/heightfield/heightfield_queries.h"
#include "ground/joined_queries.h"
#include "world/solver/body_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
Depth compute_depth(const RigidBody& body, const Ground& ground) {
    Depth deepest;
    const DistanceAnswer answer = signed_distance(*body.shape, body.pose, ground, 0.0);
    deepest.resident = answer.status != QueryStatus::not_resident;
    if (!answer.has_ground || !(answer.distance < 0.0)) return deepest;
    deepest.depth = -answer.distance;
    deepest.normal = answer.normal;
    return deepest;
}

bool is_outside(const Ground& ground, const WorldPos& point) {
    return !ground.extent().contains(point.x(), point.y()) ||
           ground.cell(ground.column_at(point.x()), ground.row_at(point.y())).status ==
               GroundStatus::outside;
}

double greatest_lift(const RigidBody& body, const Ground& ground) {
    if (may_meet_volume(ground, body.pose.translation, body.radius)) {
        return measure_mesh_depth(*body.shape, body.pose, ground).depth;
    }
    const LocalGround local(ground, body.pose.translation);
    const LocalBody there(*body.shape, body.pose.rotation, local.to_local(body.pose.translation));
    return std::max(0.0, find_lift(local, there, Eigen::Vector3d::Zero(), 0.0).lift);
}

double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least) {
    if (lift <= at_least) return at_least;
    if (may_meet_volume(ground, body.pose.translation, body.radius))
        return lift;  // near volumes the lift is the depth
    return std::max(at_least, compute_depth(body, ground).depth);
}

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
/// Reuse distance: motion after which contacts are found anew, in tolerances.
constexpr double kReuseDistance = 1.0 / 32.0;
/// Contacts are reused only if the smallest gap at the refresh was at least this, in tolerances: then ground beyond the
/// margin was at least as far away, and has approached by at most the reuse distance.
constexpr double kReusableGap = 1.0 / 8.0;
/// Least cosine between normals of the same contact in two refreshes.
constexpr double kSameNormal = 0.95;
/// Largest component difference of normals that count as unchanged.
constexpr double kSameDirection = 1e-9;
/// Share of a gap that a body may cross without a cast.
constexpr double kClearShare = 0.5;
/// Bodies over more cells than this along an axis are always cast.
constexpr double kMaxCells = 8.0;

/// The cells that a body with a margin, metres, may overlap.
CellRange cells_around(const RigidBody& body, const Ground& ground, double margin) {
    const double reach = body.radius + margin;
    const WorldPos& centre = body.pose.translation;
    return {ground.column_at(centre.x() - reach), ground.row_at(centre.y() - reach),
            ground.column_at(centre.x() + reach), ground.row_at(centre.y() + reach)};
}

/// Whether all cells below and above a body with a margin are ground: then it can only touch the surface examined in
/// the refresh, not the side of the ground.
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

Pose raised(Pose pose, double height) {
    pose.translation.z() += height;
    return pose;
}

double greatest_move(const RigidBody& body, const Pose& from, const Pose& to) {
    // A rotation moves a point by at most its distance times the spectral norm of the difference of the rotations,
    // which is bounded by the Frobenius norm.
    double turn = 0.0;
    for (int column = 0; column < 3; ++column) {
        const Eigen::Vector3d difference = to.rotation.col(column) - from.rotation.col(column);
        turn += dot(difference, difference);
    }
    return length(to.translation - from.translation) + body.radius * std::sqrt(turn);
}

void GroundContactCache::update(const RigidBody& body, const Ground& ground, double travel) {
    if (is_reusable_) {
        moved_ = greatest_move(body, refresh_pose_, body.pose);
        if (moved_ < kReuseDistance * body.tolerance) {
            follow(body);
            return;
        }
    }
    find(body, ground, 0, 0.0, travel, false);
}

void GroundContactCache::refresh_for_step(const RigidBody& body, const Ground& ground,
                                          const Ground* ground_before, double reach,
                                          double travel) {
    const bool is_clear = clear_pose_ && ground_before != nullptr &&
                          clear_pose_->rotation == body.pose.rotation &&
                          clear_pose_->translation == body.pose.translation &&
                          ground.has_same_cells(*ground_before, cells_around(body, ground, 0.0));
    forget_proof();
    find(body, ground, 0, reach, travel, is_clear);
}

void GroundContactCache::find(const RigidBody& body, const Ground& ground, int offset_index,
                              double reach, double travel, bool is_clear) {
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
    margin_ = kContactMargin * body.tolerance + reach;
    const double offset = offset_depth(body, offset_index);
    const Pose pose = raised(body.pose, offset);
    std::array<double, kMaxCount> openings;
    is_on_mesh_ = may_meet_volume(ground, body.pose.translation,
                                  body.radius + body.tolerance + margin_ + travel);
    const ContactAnswer answer =
        is_on_mesh_ ? find_on_mesh(body, ground, offset_index, found, openings)
        : is_clear  ? find_separated_contacts(*body.shape, pose, ground, margin_, found)
                    : columns::find_contacts(*body.shape, pose, ground, margin_, found);
    if (answer.status == QueryStatus::not_resident) {
        resident_ = false;
        return;
    }
    const bool is_complete = answer.status == QueryStatus::complete;
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
    // If contacts were truncated, those omitted may be nearer than those kept of another part.
    is_exhaustive_ = !is_on_mesh_ && is_complete && !contacts_.empty() &&
                     has_ground_around(body, ground, margin_);
    is_reusable_ = is_complete && offset_index == 0 && reach == 0.0 &&
                   least_gap(0.0, kReusableGap * body.tolerance) >= kReusableGap * body.tolerance;
    if (is_on_mesh_) {
        is_reusable_ = is_reusable_ && mesh_offset_.index == 0 &&
                       mesh_offset_.distance >= kReusableGap * body.tolerance;
    }
}

/// The contacts near volumes at the first offset at which the shrunk body is clear; none if there is no such offset.
ContactAnswer GroundContactCache::find_on_mesh(const RigidBody& body, const Ground& ground,
                                               int offset_index, std::span<Contact> contacts_out,
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
    const ContactAnswer answer = find_at(offset_index);
    if (mesh_offset_.is_missing || mesh_offset_.distance >= clear) return answer;
    const MeshOffset first = find_mesh_offset(body, ground, offset_index);
    if (first.is_missing || first.index == kOffsetCount) {
        mesh_offset_ = first;
        return {.status = first.is_missing ? QueryStatus::not_resident : QueryStatus::complete};
    }
    return first.index == offset_index ? answer : find_at(first.index);
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
    resident_ = is_out_of_reach_ = true;
    is_exhaustive_ = is_reusable_ = is_same_ = is_on_mesh_ = false;
    lift_ = -1.0;
    moved_ = 0.0;
}

void GroundContactCache::reset() {
    contacts_.clear();
    previous_contacts_.clear();
    step_start_contacts_.clear();
    forget_proof();
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
