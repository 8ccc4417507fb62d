// SPDX-License-Identifier: MIT
#include "bodies/islands/pair_manifolds.h"

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

std::size_t PairTouch::most(const RigidBody& a, const RigidBody& b) {
    const auto is_compound = [](const RigidBody& body) {
        return std::holds_alternative<Compound>(body.parts[0].shape);
    };
    return is_compound(a) || is_compound(b) ? kMaxTouches : 1;
}

void PairTouch::update(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                       std::span<const PairTouch> before, double duration) {
    for (PairTouch& touch : touches) touch.count_ = 0;
    const double way = closing_way(a, b, duration);
    const double margin = kMargin * tolerance_of(a, b);
    const bool touched = !before.empty() && before[0].count_ > 0;
    if (touched && way <= margin && !before[0].is_ahead_ && !have_moved(a, b, before[0])) {
        const BodyPair same = touches[0].pair;
        std::copy(before.begin(), before.end(), touches.begin());
        for (PairTouch& touch : touches) {
            touch.pair = same;
            for (std::size_t i = 0; i < touch.count_; ++i) touch.place(a, b, touch.points_[i]);
        }
        return;
    }

    const double thin = kMarginOfExtent * std::min(a.thickness, b.thickness);
    // Where they may pass each other whole, nearest points do not tell what will meet.
    if (way > thin) touches[0].look_ahead(a, b, duration);
    if (touches[0].count_ == 0) {
        const double ahead = margin + std::min(way, thin);
        // Only compounds pay for the room that they need.
        if (touches.size() == 1) {
            std::array<PairContact, kMaxCount> room;
            look(touches, a, b, ahead, room);
        } else {
            std::array<PairContact, kMaxTouches * kMaxCount> room;
            look(touches, a, b, ahead, room);
        }
    }
    for (PairTouch& touch : touches) touch.take_impulses(before);
}

void PairTouch::update_again(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                             double duration) {
    if (touches.size() == 1) {
        const PairTouch before = touches[0];
        update(touches, a, b, {&before, 1}, duration);
        return;
    }
    std::array<PairTouch, kMaxTouches> before;
    std::copy(touches.begin(), touches.end(), before.begin());
    update(touches, a, b, std::span(before).first(touches.size()), duration);
}

void PairTouch::take_impulses(std::span<const PairTouch> before) {
    for (std::size_t i = 0; i < count_; ++i) {
        for (const PairTouch& touch : before) {
            for (std::size_t k = 0; k < touch.count_; ++k) {
                const Point& old = touch.points_[k];
                if (old.feature_a == points_[i].feature_a &&
                    old.feature_b == points_[i].feature_b && old.part_a == points_[i].part_a &&
                    old.part_b == points_[i].part_b) {
                    points_[i].impulse = old.impulse;
                }
            }
        }
    }
}

/// Whether two bodies have moved past each other since they were looked at, so far that they have to be looked at
/// again.
bool PairTouch::have_moved(const RigidBody& a, const RigidBody& b, const PairTouch& before) {
    // How b moved, seen from a: what both do is no motion past each other where neither turned.
    Pose b_with_a = before.seen_b_;
    b_with_a.translation += a.pose.translation - before.seen_a_.translation;
    Pose a_turned = before.seen_a_;
    a_turned.translation = a.pose.translation;
    const double moved = greatest_move(a, a_turned, a.pose) + greatest_move(b, b_with_a, b.pose);
    return !(moved < kReach * tolerance_of(a, b));
}

/// Sets the gap of a contact where the bodies are now.
void PairTouch::place(const RigidBody& a, const RigidBody& b, Point& point) const {
    const Eigen::Vector3d arm_a = rotated(a.pose.rotation, point.core_a_body);
    const Eigen::Vector3d arm_b = rotated(b.pose.rotation, point.core_b_body);
    const Eigen::Vector3d between = a.pose.translation - b.pose.translation;
    point.gap = dot(normal_, between + arm_a - arm_b) - rounding_a_ - rounding_b_;
}

/// Shares the contacts out by what they have in common.
void PairTouch::look(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                     double margin, std::span<PairContact> room) {
    const Shape &shape_a = a.parts[0].shape, &shape_b = b.parts[0].shape;
    const PairContactAnswer answer = find_contacts(shape_a, a.pose, shape_b, b.pose, margin, room);
    for (const PairContact& contact : room.first(answer.count)) {
        const double rounding_a = rounding_of(shape_a, contact.part_a);
        const double rounding_b = rounding_of(shape_b, contact.part_b);
        const auto touch = std::find_if(touches.begin(), touches.end(), [&](const PairTouch& t) {
            return t.count_ == 0 || (t.count_ < kMaxCount && t.normal_ == contact.normal &&
                                     t.rounding_a_ == rounding_a && t.rounding_b_ == rounding_b);
        });
        if (touch == touches.end()) continue;
        if (touch->count_ == 0) touch->begin(a, b, contact, false);
        const Arms arms = touch->arms_of(contact, a.pose.translation, b.pose.translation);
        touch->take(contact, a, b, arms).gap = -contact.depth;
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
    begin(a, b, hit.contacts[0], true);
    const WorldPos then_a = motion_a.at(hit.fraction).translation;
    const WorldPos then_b = motion_b.at(hit.fraction).translation;
    for (std::size_t i = 0; i < hit.count; ++i) {
        if (!(hit.contacts[i].normal == normal_)) continue;
        // Arms as they will be, told in the frames of now.
        const Arms arms = arms_of(hit.contacts[i], then_a, then_b);
        const double closing = -dot(normal_, velocity_at(a, arms.a) - velocity_at(b, arms.b));
        take(hit.contacts[i], a, b, arms).gap = std::max(0.0, closing) * hit.fraction * duration;
    }
}

void PairTouch::begin(const RigidBody& a, const RigidBody& b, const PairContact& first,
                      bool is_ahead) {
    is_ahead_ = is_ahead;
    rounding_a_ = rounding_of(a.parts[0].shape, first.part_a);
    rounding_b_ = rounding_of(b.parts[0].shape, first.part_b);
    normal_ = first.normal;
    seen_a_ = a.pose;
    seen_b_ = b.pose;
}

PairTouch::Arms PairTouch::arms_of(const PairContact& contact, const WorldPos& centre_a,
                                   const WorldPos& centre_b) const {
    const Eigen::Vector3d on_b = contact.point_world + contact.depth * normal_;
    return {contact.point_world + rounding_a_ * normal_ - centre_a,
            on_b - rounding_b_ * normal_ - centre_b};
}

PairTouch::Point& PairTouch::take(const PairContact& contact, const RigidBody& a,
                                  const RigidBody& b, const Arms& arms) {
    Point& point = points_[count_++];
    point.impulse.setZero();
    point.core_a_body = rotated_back(a.pose.rotation, arms.a);
    point.core_b_body = rotated_back(b.pose.rotation, arms.b);
    point.feature_a = contact.feature_a;
    point.feature_b = contact.feature_b;
    point.part_a = contact.part_a;
    point.part_b = contact.part_b;
    return point;
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
