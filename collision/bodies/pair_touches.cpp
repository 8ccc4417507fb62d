// SPDX-License-Identifier: MIT
#include "pair_touches.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Contacts are looked for this far apart, in tolerances, and further by what the bodies approach in a substep.
constexpr double kMargin = 1.0 / 2.0;
/// How far bodies may move past each other before they are looked at again, in tolerances.
constexpr double kReach = 1.0 / 32.0;
/// Overlaps that are left as they are, in tolerances.
constexpr double kSlop = 1.0 / 16.0;
/// Gaps that count as none, in tolerances: a cast ends in them, and bodies may rest in them.
constexpr double kTouchingGap = 1.0 / 8.0;
/// Contacts are as long ahead as a nearest point tells where they will be, in smallest half extents.
constexpr double kMarginOfExtent = 0.5;

double tolerance_of(const RigidBody& a, const RigidBody& b) {
    return std::min(a.tolerance, b.tolerance);
}

Eigen::Vector3d velocity_at(const RigidBody& body, const Eigen::Vector3d& arm) {
    return body.velocity.linear + cross(body.velocity.angular, arm);
}

/// At most how far points of two bodies approach each other in a time.
double closing_way(const RigidBody& a, const RigidBody& b, double duration) {
    return duration *
           (length(a.velocity.linear - b.velocity.linear) + a.radius * length(a.velocity.angular) +
            b.radius * length(b.velocity.angular));
}

}  // namespace

void PairTouch::update(const RigidBody& a, const RigidBody& b, const PairTouch* before,
                       double duration) {
    count_ = 0;
    const double way = closing_way(a, b, duration);
    const double margin = kMargin * tolerance_of(a, b);
    if (before != nullptr && before->count_ > 0 && way <= margin && follow(a, b, *before)) return;

    const double thin = kMarginOfExtent * std::min(a.thickness, b.thickness);
    // Where they may pass each other whole, nearest points do not tell what will meet.
    if (way > thin) look_ahead(a, b, duration);
    if (count_ == 0) look(a, b, margin + std::min(way, thin));
    if (before == nullptr) return;
    for (std::size_t i = 0; i < count_; ++i) {
        for (std::size_t k = 0; k < before->count_; ++k) {
            const Point& old = before->points_[k];
            if (!(old.feature_a == points_[i].feature_a) ||
                !(old.feature_b == points_[i].feature_b)) {
                continue;
            }
            points_[i].impulse = old.impulse;
        }
    }
}

bool PairTouch::follow(const RigidBody& a, const RigidBody& b, const PairTouch& before) {
    if (before.is_ahead_) return false;
    // How b moved, seen from a: what both do is no motion past each other where neither turned.
    Pose b_with_a = before.seen_b_;
    b_with_a.translation += a.pose.translation - before.seen_a_.translation;
    Pose a_turned = before.seen_a_;
    a_turned.translation = a.pose.translation;
    const double moved = greatest_move(a, a_turned, a.pose) + greatest_move(b, b_with_a, b.pose);
    if (!(moved < kReach * tolerance_of(a, b))) return false;
    const BodyPair same = pair;
    *this = before;
    pair = same;
    for (std::size_t i = 0; i < count_; ++i) place(a, b, points_[i]);
    return true;
}

/// Sets the gap of a contact where the bodies are now.
void PairTouch::place(const RigidBody& a, const RigidBody& b, Point& point) const {
    const Eigen::Vector3d arm_a = rotated(a.pose.rotation, point.core_a_body);
    const Eigen::Vector3d arm_b = rotated(b.pose.rotation, point.core_b_body);
    const Eigen::Vector3d between = a.pose.translation - b.pose.translation;
    point.gap = dot(normal_, between + arm_a - arm_b) - rounding_a_ - rounding_b_;
}

void PairTouch::look(const RigidBody& a, const RigidBody& b, double margin) {
    const Shape &shape_a = a.parts[0].shape, &shape_b = b.parts[0].shape;
    std::array<PairContact, kMaxCount> found;
    const PairContactAnswer answer = find_contacts(shape_a, a.pose, shape_b, b.pose, margin, found);
    count_ = static_cast<std::uint32_t>(answer.count);
    if (count_ == 0) return;
    is_ahead_ = false;
    rounding_a_ = rounding_of(shape_a);
    rounding_b_ = rounding_of(shape_b);
    normal_ = found[0].normal;
    seen_a_ = a.pose;
    seen_b_ = b.pose;
    for (std::size_t i = 0; i < count_; ++i) {
        const PairContact& contact = found[i];
        Point& point = points_[i];
        const Eigen::Vector3d on_b = contact.point_world + contact.depth * normal_;
        point.core_a_body = rotated_back(
            a.pose.rotation, contact.point_world + rounding_a_ * normal_ - a.pose.translation);
        point.core_b_body =
            rotated_back(b.pose.rotation, on_b - rounding_b_ * normal_ - b.pose.translation);
        point.feature_a = contact.feature_a;
        point.feature_b = contact.feature_b;
        point.gap = -contact.depth;
        point.impulse.setZero();
    }
}

/// Bodies that pass more than themselves in a substep are cast. A contact ahead has the gap that its points close
/// until then, so that the bodies meet at the end of the substep.
void PairTouch::look_ahead(const RigidBody& a, const RigidBody& b, double duration) {
    const Motion motion_a{a.pose, a.velocity.linear * duration, a.velocity.angular * duration};
    const Motion motion_b{b.pose, b.velocity.linear * duration, b.velocity.angular * duration};
    const PairCastAnswer hit =
        cast(a.parts[0].shape, motion_a, b.parts[0].shape, motion_b,
             {.tolerance = kSlop * tolerance_of(a, b), .skip_separating = true});
    if (!hit.hit || hit.count == 0) return;
    is_ahead_ = true;
    count_ = static_cast<std::uint32_t>(hit.count);
    rounding_a_ = rounding_of(a.parts[0].shape);
    rounding_b_ = rounding_of(b.parts[0].shape);
    normal_ = hit.contacts[0].normal;
    const Pose then_a = motion_a.at(hit.fraction), then_b = motion_b.at(hit.fraction);
    for (std::size_t i = 0; i < count_; ++i) {
        const PairContact& contact = hit.contacts[i];
        Point& point = points_[i];
        const Eigen::Vector3d arm_a =
            contact.point_world + rounding_a_ * normal_ - then_a.translation;
        const Eigen::Vector3d arm_b = contact.point_world + contact.depth * normal_ -
                                      rounding_b_ * normal_ - then_b.translation;
        // Arms as they will be, told in the frames of now.
        point.core_a_body = rotated_back(a.pose.rotation, arm_a);
        point.core_b_body = rotated_back(b.pose.rotation, arm_b);
        point.feature_a = contact.feature_a;
        point.feature_b = contact.feature_b;
        const double closing = -dot(normal_, velocity_at(a, arm_a) - velocity_at(b, arm_b));
        point.gap = std::max(0.0, closing) * hit.fraction * duration;
        point.impulse.setZero();
    }
}

double PairTouch::first_impact(const RigidBody& a, const RigidBody& b, double bounce_speed,
                               double duration) const {
    double first = 1.0;
    for (std::size_t i = 0; i < count_; ++i) {
        const Point& point = points_[i];
        const Eigen::Vector3d velocity =
            velocity_at(a, rotated(a.pose.rotation, point.core_a_body) - rounding_a_ * normal_) -
            velocity_at(b, rotated(b.pose.rotation, point.core_b_body) + rounding_b_ * normal_);
        const double closing = -dot(normal_, velocity);
        if (closing > bounce_speed) {
            first = std::min(first, std::max(0.0, point.gap) / (closing * duration));
        }
    }
    return first;
}

SolverContact PairTouch::contact(std::size_t i, const RigidBody& a, const RigidBody& b) const {
    const Point& point = points_[i];
    SolverContact contact;
    contact.a = pair.a;
    contact.b = pair.b;
    contact.normal = normal_;
    contact.point_a =
        a.pose.translation + rotated(a.pose.rotation, point.core_a_body) - rounding_a_ * normal_;
    contact.point_b =
        b.pose.translation + rotated(b.pose.rotation, point.core_b_body) + rounding_b_ * normal_;
    contact.rounding = rounding_a_;
    const double tolerance = tolerance_of(a, b);
    contact.gap = point.gap < kTouchingGap * tolerance ? std::min(0.0, point.gap) : point.gap;
    contact.wanted_gap = -kSlop * tolerance;
    contact.friction = std::sqrt(a.friction * b.friction);
    contact.restitution = std::max(a.restitution, b.restitution);
    contact.guess = point.impulse;
    return contact;
}

}  // namespace terrane::internal
