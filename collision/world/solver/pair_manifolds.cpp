// SPDX-License-Identifier: MIT
#include "world/solver/pair_manifolds.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace terrane::internal {
namespace {

bool is_earlier_pair(const BodyPair& a, const BodyPair& b) {
    return a.a != b.a ? a.a < b.a : a.b < b.b;
}

}  // namespace

void SeparatedPairs::begin(std::span<const RigidBody> bodies) {
    const std::size_t known = std::min(poses_.size(), bodies.size());
    travel_.resize(bodies.size(), 0.0);
    poses_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const Pose& pose = bodies[i].pose;
        const bool is_unmoved =
            poses_[i].translation == pose.translation && poses_[i].rotation == pose.rotation;
        if (i >= known || is_unmoved) {
            poses_[i] = pose;
            continue;
        }
        travel_[i] += greatest_move(bodies[i], poses_[i], pose);
        poses_[i] = pose;
    }
    next_ = 0;
    kept_.clear();
    added_.clear();
}

bool SeparatedPairs::is_clear(const BodyPair& pair, double reach) {
    while (next_ < entries_.size() && is_earlier_pair(entries_[next_].pair, pair)) ++next_;
    if (next_ == entries_.size() || !(entries_[next_].pair == pair)) return false;
    if (!(entries_[next_].travel - travel_of(pair) > reach)) return false;
    kept_.push_back(entries_[next_]);
    return true;
}

void SeparatedPairs::add(const BodyPair& pair, double distance) {
    if (distance > 0.0) added_.push_back({pair, travel_of(pair) + distance});
}

void SeparatedPairs::end() {
    entries_.clear();
    std::merge(kept_.begin(), kept_.end(), added_.begin(), added_.end(),
               std::back_inserter(entries_),
               [](const Entry& a, const Entry& b) { return is_earlier_pair(a.pair, b.pair); });
}

namespace {

/// Contacts are searched up to this gap, in tolerances, plus the closing distance of the bodies in a collision step.
constexpr double kMargin = 1.0 / 2.0;
/// Relative motion up to which contacts are reused, in tolerances.
constexpr double kReach = 1.0 / 32.0;
/// Overlap that is not separated, in tolerances.
constexpr double kSlop = 1.0 / 16.0;
/// Largest gap that counts as touching, in tolerances: casts stop, and bodies may rest, within it.
constexpr double kTouchingGap = 1.0 / 8.0;
constexpr double kMostTurn = 6.0;  // radians: limit on the rotation of casts
/// Largest closing distance for which the nearest points predict the contact, relative to least_thickness().
constexpr double kMarginOfExtent = 0.5;

double tolerance_of(const RigidBody& a, const RigidBody& b) {
    return std::min(a.tolerance, b.tolerance);
}

/// The motion of a body over `duration`. The rotation is limited to kMostTurn, to bound the cost of a cast.
Motion predicted_motion(const RigidBody& body, double duration) {
    const Eigen::Vector3d turn = body.velocity.angular * duration;
    const double angle = length(turn);
    return {body.pose, body.velocity.linear * duration,
            angle > kMostTurn ? Eigen::Vector3d(turn * (kMostTurn / angle)) : turn};
}

/// Thickness through which the bodies of a pair must not tunnel in a step: the smaller of their thicknesses if both are
/// dynamic, otherwise the larger, because a wall may be thin.
double least_thickness(const RigidBody& a, const RigidBody& b) {
    return is_dynamic(a) && is_dynamic(b) ? std::min(a.thickness, b.thickness)
                                          : std::max(a.thickness, b.thickness);
}

Eigen::Vector3d velocity_at(const RigidBody& body, const Eigen::Vector3d& arm) {
    return body.velocity.linear + cross(body.velocity.angular, arm);
}

/// Upper bound of the surface speed due to rotation, m/s; rotation of a sphere or capsule about an axis of symmetry
/// does not move its surface.
double turning_speed(const RigidBody& body) {
    const Eigen::Vector3d& spin = body.velocity.angular;
    const Shape& shape = *body.shape;
    if (std::holds_alternative<Sphere>(shape)) return 0.0;
    if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        return capsule->half_height * length(cross(spin, body.pose.rotation.col(2)));
    }
    return body.radius * length(spin);
}

/// Upper bound of the distance by which two bodies approach within `duration`, metres.
double closing_distance(const RigidBody& a, const RigidBody& b, double duration) {
    return duration *
           (length(a.velocity.linear - b.velocity.linear) + turning_speed(a) + turning_speed(b));
}

}  // namespace

std::size_t PairManifold::max_count(const RigidBody& a, const RigidBody& b) {
    const auto is_compound = [](const RigidBody& body) {
        return std::holds_alternative<Compound>(*body.shape);
    };
    return is_compound(a) || is_compound(b) ? kMaxManifolds : 1;
}

double PairManifold::contact_reach(const RigidBody& a, const RigidBody& b, double duration) {
    return kMargin * tolerance_of(a, b) + closing_distance(a, b, duration);
}

void PairManifold::update(std::span<PairManifold> manifolds, const RigidBody& a, const RigidBody& b,
                          std::span<const PairManifold> before, double duration) {
    for (PairManifold& manifold : manifolds) manifold.count_ = 0;
    const double closing = closing_distance(a, b, duration);
    const double margin = kMargin * tolerance_of(a, b);
    const bool touched = !before.empty() && before[0].count_ > 0;
    if (touched && closing <= margin && !before[0].is_predicted_ && !has_moved(a, b, before[0])) {
        const BodyPair same = manifolds[0].pair;
        std::copy(before.begin(), before.end(), manifolds.begin());
        for (PairManifold& manifold : manifolds) {
            manifold.pair = same;
            manifold.follow(a, b);
        }
        return;
    }

    const double thickness = least_thickness(a, b);
    const double ahead = margin + std::min(closing, thickness);
    // Only compounds need the larger buffer.
    if (manifolds.size() == 1) {
        std::array<PairContact, kMaxCount> buffer;
        collide(manifolds, a, b, ahead, buffer);
    } else {
        std::array<PairContact, kMaxManifolds * kMaxCount> buffer;
        collide(manifolds, a, b, ahead, buffer);
    }
    // Nearest points do not predict the contact of bodies that may tunnel in a step, unless they touch and rotate
    // slowly.
    if (closing > kMarginOfExtent * thickness) {
        const double turning = duration * (turning_speed(a) + turning_speed(b));
        const bool touches = manifolds[0].count_ > 0 && manifolds[0].least_gap() <= margin;
        const bool is_reached = manifolds[0].count_ > 0 || closing > thickness;
        if (is_reached && (!touches || turning > thickness))
            predict_impact(manifolds, a, b, duration);
    }
    for (PairManifold& manifold : manifolds) manifold.warm_start(before);
}

void PairManifold::warm_start(std::span<const PairManifold> before) {
    for (std::size_t i = 0; i < count_; ++i) {
        for (const PairManifold& manifold : before) {
            for (std::size_t k = 0; k < manifold.count_; ++k) {
                const Point& old = manifold.points_[k];
                if (old.feature_a == points_[i].feature_a &&
                    old.feature_b == points_[i].feature_b && old.part_a == points_[i].part_a &&
                    old.part_b == points_[i].part_b) {
                    points_[i].impulse = old.impulse;
                }
            }
        }
    }
}

/// Whether the relative motion of two bodies since their contacts were found exceeds the reuse distance.
bool PairManifold::has_moved(const RigidBody& a, const RigidBody& b, const PairManifold& before) {
    // Motion of b relative to a: a common translation does not change contacts.
    Pose b_with_a = before.pose_b_;
    b_with_a.translation += a.pose.translation - before.pose_a_.translation;
    Pose a_turned = before.pose_a_;
    a_turned.translation = a.pose.translation;
    const double moved = greatest_move(a, a_turned, a.pose) + greatest_move(b, b_with_a, b.pose);
    return !(moved < kReach * tolerance_of(a, b));
}

void PairManifold::follow(const RigidBody& a, const RigidBody& b) {
    for (std::size_t i = 0; i < count_; ++i) {
        points_[i].gap = points_[i].gap_offset + core_separation(a, b, points_[i]);
    }
}

/// Distance between a contact's core points along the normal.
double PairManifold::core_separation(const RigidBody& a, const RigidBody& b,
                                     const Point& point) const {
    const Eigen::Vector3d arm_a = rotated(a.pose.rotation, point.core_a_body);
    const Eigen::Vector3d arm_b = rotated(b.pose.rotation, point.core_b_body);
    const Eigen::Vector3d between = a.pose.translation - b.pose.translation;
    return dot(normal_, between + arm_a - arm_b);
}

/// Finds the contacts and sorts them into manifolds by normal and rounding.
void PairManifold::collide(std::span<PairManifold> manifolds, const RigidBody& a,
                           const RigidBody& b, double margin, std::span<PairContact> buffer) {
    const Shape &shape_a = *a.shape, &shape_b = *b.shape;
    const PairContactAnswer answer =
        find_contacts(shape_a, a.pose, shape_b, b.pose, margin, buffer);
    manifolds[0].least_distance_ = answer.least_distance;
    for (const PairContact& contact : buffer.first(answer.count)) {
        const double rounding_a = rounding_of(shape_a, contact.part_a);
        const double rounding_b = rounding_of(shape_b, contact.part_b);
        const auto manifold =
            std::find_if(manifolds.begin(), manifolds.end(), [&](const PairManifold& t) {
                return t.count_ == 0 ||
                       (t.count_ < kMaxCount && t.normal_ == contact.normal &&
                        t.rounding_a_ == rounding_a && t.rounding_b_ == rounding_b);
            });
        if (manifold == manifolds.end()) continue;
        if (manifold->count_ == 0) manifold->reset(a, b, contact, false);
        const Arms arms = manifold->arms_of(contact, a.pose.translation, b.pose.translation);
        manifold->add_point(contact, a, b, arms, -contact.depth);
    }
}

double PairManifold::least_gap() const {
    double least = points_[0].gap;
    for (std::size_t i = 1; i < count_; ++i) least = std::min(least, points_[i].gap);
    return least;
}

/// Finds the contact of fast bodies by a cast. The contact's gap is the distance that its points close until the time
/// of impact, so that the solver lets the bodies meet at that time.
void PairManifold::predict_impact(std::span<PairManifold> manifolds, const RigidBody& a,
                                  const RigidBody& b, double duration) {
    const Motion motion_a = predicted_motion(a, duration);
    const Motion motion_b = predicted_motion(b, duration);
    const PairCastAnswer hit =
        cast(*a.shape, motion_a, *b.shape, motion_b,
             {.tolerance = kMargin * tolerance_of(a, b), .skip_separating = true});
    if (!hit.hit || hit.count == 0) return;
    for (PairManifold& manifold : manifolds) manifold.count_ = 0;
    PairManifold& first = manifolds[0];
    first.reset(a, b, hit.contacts[0], true);
    const WorldPos then_a = motion_a.at(hit.fraction).translation;
    const WorldPos then_b = motion_b.at(hit.fraction).translation;
    for (std::size_t i = 0; i < hit.count; ++i) {
        if (!(hit.contacts[i].normal == first.normal_)) continue;
        // Arms at the time of impact, in the bodies' current frames.
        const Arms arms = first.arms_of(hit.contacts[i], then_a, then_b);
        const double closing = -dot(first.normal_, velocity_at(a, arms.a) - velocity_at(b, arms.b));
        const double left = std::max(0.0, -hit.contacts[i].depth);
        first.add_point(hit.contacts[i], a, b, arms,
                        std::max(0.0, closing) * hit.fraction * duration + left);
    }
}

void PairManifold::reset(const RigidBody& a, const RigidBody& b, const PairContact& first,
                         bool is_predicted) {
    is_predicted_ = is_predicted;
    rounding_a_ = rounding_of(*a.shape, first.part_a);
    rounding_b_ = rounding_of(*b.shape, first.part_b);
    normal_ = first.normal;
    pose_a_ = a.pose;
    pose_b_ = b.pose;
}

PairManifold::Arms PairManifold::arms_of(const PairContact& contact, const WorldPos& centre_a,
                                         const WorldPos& centre_b) const {
    const Eigen::Vector3d on_b = contact.point_world + contact.depth * normal_;
    return {contact.point_world + rounding_a_ * normal_ - centre_a,
            on_b - rounding_b_ * normal_ - centre_b};
}

void PairManifold::add_point(const PairContact& contact, const RigidBody& a, const RigidBody& b,
                             const Arms& arms, double gap) {
    Point& point = points_[count_++];
    point.impulse.setZero();
    point.core_a_body = rotated_back(a.pose.rotation, arms.a);
    point.core_b_body = rotated_back(b.pose.rotation, arms.b);
    point.feature_a = contact.feature_a;
    point.feature_b = contact.feature_b;
    point.part_a = contact.part_a;
    point.part_b = contact.part_b;
    point.gap = gap;
    point.gap_offset = gap - core_separation(a, b, point);
}

double PairManifold::gap(std::size_t i, const RigidBody& a, const RigidBody& b) const {
    return points_[i].gap_offset + core_separation(a, b, points_[i]);
}

double PairManifold::touching_gap(const RigidBody& a, const RigidBody& b) {
    return kTouchingGap * tolerance_of(a, b);
}

double PairManifold::solved_gap(std::size_t i, const RigidBody& a, const RigidBody& b) const {
    const double gap = points_[i].gap;
    return gap < kTouchingGap * tolerance_of(a, b) ? std::min(0.0, gap) : gap;
}

SolverContact PairManifold::contact(std::size_t i, const RigidBody& a, const RigidBody& b) const {
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
    contact.gap = solved_gap(i, a, b);
    contact.target_gap = -kSlop * tolerance_of(a, b);
    contact.friction =
        combined_friction(friction_of(a, point.part_a), friction_of(b, point.part_b));
    contact.restitution = combined_restitution(a.restitution, b.restitution);
    contact.initial_impulse = point.impulse;
    return contact;
}

}  // namespace terrane::internal
