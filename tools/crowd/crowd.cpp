// SPDX-License-Identifier: MIT
#include "crowd/crowd.h"

#include "query/parsing/quaternion.h"
#include "world/body_random.h"

#include <terrane/collision/convex_hull.h>
#include <terrane/collision/ground_cast.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>

namespace terrane::tools {
namespace {

constexpr int kFewestRings = 2;  // with fewer, all corners lie in a plane
constexpr int kMostRings = 200;

double now_ms() {
    return std::chrono::duration<double, std::milli>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// The hull of corners on a sphere: two poles, and rings between them at equal angles.
ConvexHull make_ball(int rings, double radius) {
    std::vector<Eigen::Vector3d> points{{0.0, 0.0, radius}, {0.0, 0.0, -radius}};
    // Motion::at() gives the same bits on every machine; sin() and cos() do not.
    Motion tilt, turn;
    tilt.rotation_vector = Eigen::Vector3d(0.0, std::numbers::pi, 0.0);
    turn.rotation_vector = Eigen::Vector3d(0.0, 0.0, 2.0 * std::numbers::pi);
    for (int ring = 1; ring <= rings; ++ring) {
        const Pose down = tilt.at(static_cast<double>(ring) / (rings + 1));
        for (int k = 0; k < 2 * rings; ++k) {
            const Pose around = turn.at(static_cast<double>(k) / (2 * rings));
            points.emplace_back(radius * (around.rotation * down.rotation.col(2)));
        }
    }
    return ConvexHull::create(points).value();
}

// Approximately normal: the sum of twelve uniform numbers (central limit theorem).
double normal(BodyRandom& random) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += random.unit();
    return sum;
}

Eigen::Vector3d direction(BodyRandom& random) {
    const std::array<double, 3> v = random.direction<3>();
    return {v[0], v[1], v[2]};
}

}  // namespace

Crowd::Crowd(const CrowdLayout& layout)
    : radius_(layout.radius), broadphase_(make_broadphase(layout.broadphase, 0.0)) {
    const double ball = 4.0 / 3.0 * std::numbers::pi * std::pow(layout.radius, 3);
    width_ = std::max(std::cbrt(static_cast<double>(layout.count) * ball / layout.share),
                      2.0 * layout.radius);
    // Bodies of the same detail share one hull.
    std::map<int, ConvexHull> hulls;
    for (std::size_t i = 0; i < layout.count; ++i) {
        BodyRandom random(layout.seed, i);
        const double detail = layout.detail + layout.detail_deviation * normal(random);
        const int rings = static_cast<int>(
            std::lround(std::clamp(detail, double{kFewestRings}, double{kMostRings})));
        auto hull = hulls.find(rings);
        if (hull == hulls.end()) {
            hull = hulls.emplace(rings, make_ball(rings, layout.radius)).first;
        }
        corner_count_ += static_cast<std::size_t>(2 * rings * rings + 2);
        Pose pose;
        pose.rotation = matrix_from_quaternion(random.direction<4>());
        for (int axis = 0; axis < 3; ++axis) {
            pose.translation[axis] = random.within(layout.radius, width_ - layout.radius);
        }
        const Eigen::Vector3d velocity = layout.speed * direction(random);
        bodies_.push_back({hull->second, pose, velocity, layout.spin * direction(random)});
    }
    bounds_.resize(layout.count);
    balls_.resize(layout.count);
}

void Crowd::move(double dt) {
    for (Body& body : bodies_) {
        Motion motion;
        motion.start = body.pose;
        motion.translation = dt * body.velocity;
        motion.rotation_vector = dt * body.angular_velocity;
        body.pose = motion.at(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            double& p = body.pose.translation[axis];
            const bool is_low = p < radius_;
            if (!is_low && p <= width_ - radius_) continue;
            p = std::clamp(p, radius_, width_ - radius_);
            body.velocity[axis] =
                is_low ? std::abs(body.velocity[axis]) : -std::abs(body.velocity[axis]);
        }
    }
}

void Crowd::place_bounds() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const Body& body = bodies_[i];
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d along = body.pose.rotation.row(axis);
            bounds_[i].low[axis] =
                body.pose.translation[axis] - support_distance(body.shape, -along);
            bounds_[i].high[axis] =
                body.pose.translation[axis] + support_distance(body.shape, along);
        }
        balls_[i] = {body.pose.translation, radius_};
    }
}

CrowdQuery Crowd::query() {
    CrowdQuery query;
    const double start = now_ms();
    place_bounds();
    broadphase_->update(bounds_, balls_);
    const double updated = now_ms();
    const std::span<const BodyPair> pairs = broadphase_->find_pairs();
    for (const BodyPair& pair : pairs) {
        const Body& a = bodies_[pair.a];
        const Body& b = bodies_[pair.b];
        query.touching += test_contact(a.shape, a.pose, b.shape, b.pose).is_touching ? 1u : 0u;
    }
    query.query_ms = now_ms() - updated;
    query.update_ms = updated - start;
    query.pairs = pairs.size();
    query.candidates = broadphase_->candidate_count();
    return query;
}

}  // namespace terrane::tools
