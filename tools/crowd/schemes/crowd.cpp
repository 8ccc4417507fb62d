// SPDX-License-Identifier: MIT
#include "crowd/schemes/crowd.h"

#include "crowd/schemes/cell_grids.h"
#include "crowd/schemes/crowd_shapes.h"
#include "query/parsing/quaternion.h"
#include "world/body_random.h"

#include <terrane/collision/ground_cast.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

constexpr int kFewestRings = 2;  // with fewer, all corners lie in a plane
constexpr int kMostRings = 200;
constexpr int kSizes = 100;  // of a spread: few enough for bodies to share their meshes

double now_ms() {
    return std::chrono::duration<double, std::milli>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

Eigen::Vector3d direction(BodyRandom& random) {
    const std::array<double, 3> v = random.direction<3>();
    return {v[0], v[1], v[2]};
}

// Equal ratios from each size to the next; the layout's radius is their geometric mean.
double radius_of(const CrowdLayout& layout, int size) {
    if (layout.size_spread == 1.0) return layout.radius;
    const double share = static_cast<double>(size) / (kSizes - 1);
    return layout.radius * std::pow(layout.size_spread, share - 0.5);
}

// Draws numbers of sizes, small ones more often where the layout has a size power.
class SizeDraw {
public:
    explicit SizeDraw(const CrowdLayout& layout) : is_spread_(layout.size_spread != 1.0) {
        double sum = 0.0;
        for (int size = 0; size < kSizes; ++size) {
            sum += std::pow(radius_of(layout, size) / layout.radius, -layout.size_power);
            sums_[static_cast<std::size_t>(size)] = sum;
        }
    }
    // Without a spread all have size 0.
    int draw(BodyRandom& random) const {
        if (!is_spread_) return 0;
        const auto found =
            std::upper_bound(sums_.begin(), sums_.end(), random.unit() * sums_.back());
        return std::min(static_cast<int>(found - sums_.begin()), kSizes - 1);
    }

private:
    bool is_spread_;
    std::array<double, kSizes> sums_{};  ///< of the shares of sizes, up to and with each
};

// Uniform with the layout's mean and deviation.
int draw_rings(const CrowdLayout& layout, BodyRandom& random) {
    const double half_width = std::sqrt(3.0) * layout.detail_deviation;
    const double detail = layout.detail + half_width * random.within(-1.0, 1.0);
    return static_cast<int>(
        std::lround(std::clamp(detail, double{kFewestRings}, double{kMostRings})));
}

std::unique_ptr<Broadphase> make_scheme(const CrowdLayout& layout, double width) {
    switch (layout.scheme) {
        case CrowdScheme::grid:
            return make_broadphase(BroadphaseKind::grid, 0.0);
        case CrowdScheme::brute:
            return make_broadphase(BroadphaseKind::brute, 0.0);
        case CrowdScheme::hashed:
            return make_hashed_grid(width, layout.count);
        case CrowdScheme::dense:
            return make_dense_grid(width);
        case CrowdScheme::sap:
        case CrowdScheme::two_scene:
            break;
    }
    return make_broadphase(BroadphaseKind::sap, 0.0);
}

Aabb box_of(const Shape& shape, const Pose& pose) {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d along = pose.rotation.row(axis);
        box.low[axis] = pose.translation[axis] - support_distance(shape, -along);
        box.high[axis] = pose.translation[axis] + support_distance(shape, along);
    }
    return box;
}

}  // namespace

std::string_view to_string(CrowdScheme scheme) {
    switch (scheme) {
        case CrowdScheme::sap:
            return "sap";
        case CrowdScheme::grid:
            return "grid";
        case CrowdScheme::two_scene:
            return "two-scene";
        case CrowdScheme::hashed:
            return "hashed";
        case CrowdScheme::dense:
            return "dense";
        case CrowdScheme::brute:
            break;
    }
    return "brute";
}

Crowd::Crowd(const CrowdLayout& layout) : is_two_scene_(layout.scheme == CrowdScheme::two_scene) {
    place_bodies(layout);
    broadphase_ = make_scheme(layout, width_);
    bounds_.resize(layout.count);
    balls_.resize(layout.count);
    if (is_two_scene_) {
        exact_.resize(layout.count);
        exact_in_query_.resize(layout.count);
    }
}

void Crowd::place_bodies(const CrowdLayout& layout) {
    const SizeDraw sizes(layout);
    double cubes = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < layout.count; ++i) {
        BodyRandom random(layout.seed, i);
        const double radius = radius_of(layout, sizes.draw(random));
        cubes += radius * radius * radius;
        largest = std::max(largest, radius);
    }
    const double volume = 4.0 / 3.0 * std::numbers::pi * cubes;
    width_ =
        std::max(layout.room > 0.0 ? layout.room : std::cbrt(volume / layout.share), 2.0 * largest);
    // Bodies of the same mesh share one shape.
    std::map<std::pair<int, int>, Shape> shapes;
    for (std::size_t i = 0; i < layout.count; ++i) {
        BodyRandom random(layout.seed, i);
        const int size = sizes.draw(random);
        const double radius = radius_of(layout, size);
        const BallMesh mesh{.rings = draw_rings(layout, random),
                            .radius = radius,
                            .aspect = layout.aspect,
                            .is_dented = layout.is_dented};
        const std::pair key(size, mesh.rings);
        auto shape = shapes.find(key);
        if (shape == shapes.end()) shape = shapes.emplace(key, make_ball(mesh)).first;
        corner_count_ += tools::corner_count(mesh);
        Pose pose;
        pose.rotation = matrix_from_quaternion(random.direction<4>());
        for (int axis = 0; axis < 3; ++axis) {
            pose.translation[axis] = random.within(radius, width_ - radius);
        }
        const Eigen::Vector3d velocity = layout.speed * direction(random);
        bodies_.push_back({shape->second, radius, pose, velocity, layout.spin * direction(random)});
    }
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
            const bool is_low = p < body.radius;
            if (!is_low && p <= width_ - body.radius) continue;
            p = std::clamp(p, body.radius, width_ - body.radius);
            body.velocity[axis] =
                is_low ? std::abs(body.velocity[axis]) : -std::abs(body.velocity[axis]);
        }
    }
}

void Crowd::place_bounds() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const Body& body = bodies_[i];
        bounds_[i] = box_of(body.shape, body.pose);
        balls_[i] = {body.pose.translation, body.radius};
    }
}

void Crowd::place_cubes() {
    // Wider than the sphere by more than the rounding of a box.
    constexpr double kRoundingMargin = 1e-11;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const Body& body = bodies_[i];
        const double half = body.radius + kRoundingMargin * (body.radius + 3.0 * width_);
        const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
        bounds_[i] = {body.pose.translation - around, body.pose.translation + around};
        balls_[i] = {body.pose.translation, body.radius};
    }
}

const Aabb& Crowd::exact_box(std::uint32_t body, CrowdQuery& query) {
    if (exact_in_query_[body] != query_count_) {
        exact_[body] = box_of(bodies_[body].shape, bodies_[body].pose);
        exact_in_query_[body] = query_count_;
        ++query.boxes;
    }
    return exact_[body];
}

bool Crowd::do_boxes_overlap(const BodyPair& pair, CrowdQuery& query) {
    return overlap(exact_box(pair.a, query), exact_box(pair.b, query));
}

CrowdQuery Crowd::query() {
    CrowdQuery query;
    ++query_count_;
    const double start = now_ms();
    if (is_two_scene_) {
        place_cubes();
    } else {
        place_bounds();
        query.boxes = bodies_.size();
    }
    const double placed = now_ms();
    broadphase_->update(bounds_, balls_);
    const double updated = now_ms();
    for (const BodyPair& pair : broadphase_->find_pairs()) {
        if (is_two_scene_ && !do_boxes_overlap(pair, query)) continue;
        ++query.pairs;
        const Body& a = bodies_[pair.a];
        const Body& b = bodies_[pair.b];
        query.touching += test_contact(a.shape, a.pose, b.shape, b.pose).is_touching ? 1u : 0u;
    }
    query.query_ms = now_ms() - updated;
    query.update_ms = updated - placed;
    query.boxes_ms = placed - start;
    query.candidates = broadphase_->candidate_count();
    return query;
}

}  // namespace terrane::tools
