// SPDX-License-Identifier: MIT
#include "bodies/step/ground_contact_cache.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

constexpr double kGateRatio = 0.85;
constexpr std::array<double, kGateCount> make_gate_heights() {
    std::array<double, kGateCount> heights{};
    double left = 1.0 - kFirstGate;
    for (double& height : heights) {
        height = 1.0 - left;
        left *= kGateRatio;
    }
    return heights;
}
constexpr std::array<double, kGateCount> kGateHeights = make_gate_heights();
/// How far a body may move before it is looked at again, in tolerances.
constexpr double kLookReach = 1.0 / 32.0;
/// Only looks of bodies that were at least this far from the gate are kept, in tolerances: what they missed was
/// as far away, and cannot have come nearer than by the reach.
constexpr double kKeptGap = 1.0 / 8.0;
/// Cosine between the normals of what counts as one contact in two looks.
constexpr double kSameNormal = 0.95;
/// How far components of normals that count as the same are from each other.
constexpr double kSameDirection = 1e-9;
/// The share of a gap that a body may cross without being cast.
constexpr double kSureShare = 0.5;
/// Bodies over more cells than this each way are always cast.
constexpr double kMaxCells = 8.0;

/// Whether all cells below and above a body and its margin are ground: then nothing but what a look finds can
/// be in its way, and not the ground's side.
bool has_ground_around(const RigidBody& body, const Ground& ground) {
    const double reach = body.radius + body.tolerance;
    const WorldPos& centre = body.pose.translation;
    if (!(2.0 * reach < kMaxCells * ground.spacing())) return false;
    const std::int64_t east = ground.column_at(centre.x() + reach);
    const std::int64_t north = ground.row_at(centre.y() + reach);
    GroundReader reader(ground);
    for (std::int64_t row = ground.row_at(centre.y() - reach); row <= north; ++row) {
        for (std::int64_t column = ground.column_at(centre.x() - reach); column <= east; ++column) {
            if (reader.cell(column, row).status != GroundStatus::ok) return false;
        }
    }
    return true;
}

}  // namespace

double lowering(const RigidBody& body, int gate) {
    return body.tolerance * kGateHeights[static_cast<std::size_t>(gate)];
}

Pose raised(Pose pose, double height) {
    pose.translation.z() += height;
    return pose;
}

double greatest_move(const RigidBody& body, const Pose& from, const Pose& to) {
    // A turn moves points by no more than their distance times the largest stretch of the difference of the
    // rotations, which is at most its Frobenius norm.
    double turn = 0.0;
    for (int column = 0; column < 3; ++column) {
        const Eigen::Vector3d difference = to.rotation.col(column) - from.rotation.col(column);
        turn += dot(difference, difference);
    }
    return length(to.translation - from.translation) + body.radius * std::sqrt(turn);
}

void GroundLook::update(const RigidBody& body, const Ground& ground) {
    if (is_kept_) {
        moved_ = greatest_move(body, pose_seen_, body.pose);
        if (moved_ < kLookReach * body.tolerance) {
            follow(body);
            return;
        }
    }
    look(body, ground, 0);
}

void GroundLook::look(const RigidBody& body, const Ground& ground, int gate) {
    std::array<Contact, kMaxCount> found;
    std::swap(contacts_, contacts_before_);
    contacts_.clear();
    resident_ = true;
    is_far_ = false;
    is_whole_ = false;
    is_kept_ = false;
    is_same_ = true;
    bool is_complete = true;
    lift_ = -1.0;
    moved_ = 0.0;
    pose_seen_ = body.pose;
    for (std::size_t p = 0; p < body.parts.size(); ++p) {
        const BodyPart& part = body.parts[p];
        const ContactAnswer answer =
            find_contacts(part.shape, raised(part_pose(part, body.pose), lowering(body, gate)),
                          ground, kContactMargin * body.tolerance,
                          std::span<Contact>(found).first(kMaxCount - contacts_.size()));
        if (answer.status == QueryStatus::not_resident) {
            resident_ = false;
            return;
        }
        is_complete = is_complete && answer.status == QueryStatus::complete;
        lift_ = std::max(lift_, answer.lift);
        for (std::size_t i = 0; i < answer.count; ++i) {
            Place place;
            place.feature = found[i].feature;
            place.part = static_cast<std::uint32_t>(p);
            place.piece = found[i].part;
            place.normal = found[i].normal;
            const Place* const before = find_before(place);
            place.impulse = before != nullptr ? before->impulse : Eigen::Vector3d::Zero();
            is_same_ = is_same_ && before != nullptr &&
                       (before->normal - place.normal).isZero(kSameDirection);
            place.gap = place.gap_seen = -found[i].depth;
            place.rounding = rounding_of(part.shape, place.piece);
            place.core_seen = found[i].point_world + place.rounding * place.normal;
            place.core_seen.z() -= lowering(body, gate);
            place.core_body =
                rotated_back(body.pose.rotation, place.core_seen - body.pose.translation);
            contacts_.push_back(place);
        }
    }
    is_same_ = is_same_ && contacts_.size() == contacts_before_.size();
    // What was cut off may be nearer than what was kept of another part: such a look promises nothing.
    is_whole_ = is_complete && !contacts_.empty() && has_ground_around(body, ground);
    is_kept_ = is_complete && gate == 0 &&
               least_gap(0.0, kKeptGap * body.tolerance) >= kKeptGap * body.tolerance;
}

void GroundLook::see_nothing() {
    contacts_.clear();
    resident_ = is_far_ = true;
    is_whole_ = is_kept_ = is_same_ = false;
    lift_ = -1.0;
    moved_ = 0.0;
}

/// The contact of the same feature in the last look, or null.
const GroundLook::Place* GroundLook::find_before(const Place& place) const {
    for (const Place& old : contacts_before_) {
        if (old.feature == place.feature && old.part == place.part && old.piece == place.piece &&
            dot(old.normal, place.normal) > kSameNormal) {
            return &old;
        }
    }
    return nullptr;
}

void GroundLook::follow(const RigidBody& body) {
    for (Place& place : contacts_) {
        const Eigen::Vector3d core =
            rotated(body.pose.rotation, place.core_body) + body.pose.translation;
        place.gap = place.gap_seen + dot(place.normal, core - place.core_seen);
    }
}

double GroundLook::least_gap(double further, double most) const {
    double least = most;
    for (const Place& place : contacts_) {
        least = std::min(least, place.normal.z() * further + place.gap);
    }
    return least;
}

double GroundLook::free_way(const RigidBody& body, double further) const {
    if (is_far_) return std::numeric_limits<double>::infinity();
    if (!is_whole_) return 0.0;
    return kSureShare * least_gap(further, kContactMargin * body.tolerance) - moved_;
}

SolverContact GroundLook::contact(std::size_t i, const RigidBody& body, std::uint32_t index) const {
    const Place& place = contacts_[i];
    SolverContact contact;
    contact.a = index;
    contact.normal = place.normal;
    contact.point_a = rotated(body.pose.rotation, place.core_body) + body.pose.translation -
                      place.rounding * place.normal;
    contact.rounding = place.rounding;
    contact.gap = place.gap;
    contact.rest_gap = kRestGap * body.tolerance;
    contact.wanted_gap = kSeparationGap * body.tolerance;
    contact.guess = place.impulse;
    contact.friction = body.friction;
    contact.restitution = body.restitution;
    return contact;
}

}  // namespace terrane::internal
