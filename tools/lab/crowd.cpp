// SPDX-License-Identifier: MIT
#include "lab/crowd.h"

#include "program/geometry.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/shapes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

/// A sphere-like closed mesh: two poles, and rings of corners between them at equal angles.
struct BallMesh {
    int rings = 3;        ///< 2 or more; a ring has 2 * rings corners
    double radius = 1.0;  ///< of the sphere through the corners, metres
    double aspect = 1.0;  ///< >= 1: factor by which the mesh is narrower across its poles' axis
    bool is_dented =
        false;  ///< every second segment between two meridians has 0.7 of the radius, so that the mesh is not convex
};

/// Number of corners of a mesh.
constexpr std::size_t corners_of(const BallMesh& mesh) {
    return 2 * static_cast<std::size_t>(mesh.rings) * static_cast<std::size_t>(mesh.rings) + 2;
}

// Corners on one meridian, from pole to pole, excluding the poles.
std::vector<Eigen::Vector3d> meridian(const BallMesh& mesh, int number, double scale) {
    // Motion::at() is bit-identical on every machine; sin() and cos() are not
    Motion tilt, turn;
    tilt.rotation_vector = Eigen::Vector3d(0.0, std::numbers::pi, 0.0);
    turn.rotation_vector = Eigen::Vector3d(0.0, 0.0, 2.0 * std::numbers::pi);
    const Pose around = turn.at(static_cast<double>(number) / (2 * mesh.rings));
    std::vector<Eigen::Vector3d> corners;
    for (int ring = 1; ring <= mesh.rings; ++ring) {
        const Pose down = tilt.at(static_cast<double>(ring) / (mesh.rings + 1));
        Eigen::Vector3d corner = mesh.radius * (around.rotation * down.rotation.col(2));
        corner.x() *= scale / mesh.aspect;
        corner.y() *= scale / mesh.aspect;
        corners.push_back(corner);
    }
    return corners;
}

// The mesh as a shape around its centre: a hull, or, if dented, a compound of one hull per segment.
Shape make_ball(const BallMesh& mesh) {
    constexpr double kDent = 0.7;
    const int meridians = 2 * mesh.rings;
    const Eigen::Vector3d pole(0.0, 0.0, mesh.radius);
    std::vector<Eigen::Vector3d> points{pole, -pole};
    if (!mesh.is_dented) {
        for (int number = 0; number < meridians; ++number) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, number, 1.0);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        return ConvexHull::create(points).value();
    }
    std::vector<CompoundPart> parts;
    for (int number = 0; number < meridians; ++number) {
        points.resize(2);
        const double scale = number % 2 == 0 ? 1.0 : kDent;
        for (const int side : {number, number + 1}) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, side % meridians, scale);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        parts.push_back({ConvexHull::create(points).value(), Pose{}});
    }
    return Compound::create(parts).value();
}

constexpr int kFewestRings = 2;  // with fewer, all corners lie in a plane
constexpr int kMostRings = 200;
constexpr int kSizes = 100;  // number of different sizes: small, so that bodies share meshes

// The radius of a size. The radii are in geometric progression, and the layout's radius is their geometric mean.
double radius_of(const CrowdLayout& layout, int size) {
    if (layout.size_spread == 1.0) return layout.radius;
    const double share = static_cast<double>(size) / (kSizes - 1);
    return layout.radius * std::pow(layout.size_spread, share - 0.5);
}

// Draws size indices; small ones are more frequent if the layout has a size power.
class SizeDraw {
public:
    explicit SizeDraw(const CrowdLayout& layout) : is_spread_(layout.size_spread != 1.0) {
        double sum = 0.0;
        for (int size = 0; size < kSizes; ++size) {
            sum += std::pow(radius_of(layout, size) / layout.radius, -layout.size_power);
            sums_[static_cast<std::size_t>(size)] = sum;
        }
    }
    // returns size 0 if all sizes are equal
    int draw(BodyRandom& random) const {
        if (!is_spread_) return 0;
        const auto found =
            std::upper_bound(sums_.begin(), sums_.end(), random.unit() * sums_.back());
        return std::min(static_cast<int>(found - sums_.begin()), kSizes - 1);
    }

private:
    bool is_spread_;
    std::array<double, kSizes> sums_{};  ///< cumulative shares of the sizes
};

// Draws a number of rings, uniform with the layout's mean and deviation.
int draw_rings(const CrowdLayout& layout, BodyRandom& random) {
    const double half_width = std::sqrt(3.0) * layout.detail_deviation;
    const double detail = layout.detail + half_width * random.within(-1.0, 1.0);
    return static_cast<int>(
        std::lround(std::clamp(detail, double{kFewestRings}, double{kMostRings})));
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

Crowd::Crowd(const CrowdLayout& layout) : scheme_(layout.scheme) {
    place_bodies(layout);
    broadphase_ = make_scheme(layout.scheme, width_, layout.count);
    bounds_.resize(layout.count);
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
        corner_count_ += corners_of(mesh);
        Pose pose;
        pose.rotation = random.rotation();
        for (int axis = 0; axis < 3; ++axis) {
            pose.translation[axis] = random.within(radius, width_ - radius);
        }
        const Eigen::Vector3d velocity = layout.speed * random.direction();
        bodies_.push_back(
            {shape->second, radius, pose, velocity, layout.spin * random.direction()});
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
    // margin around the sphere, larger than the rounding error of a box
    constexpr double kRoundingMargin = 1e-11;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const Body& body = bodies_[i];
        if (!is_of_cubes(scheme_)) {
            bounds_[i] = box_of(body.shape, body.pose);
            continue;
        }
        const double half = body.radius + kRoundingMargin * (body.radius + 3.0 * width_);
        const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
        bounds_[i] = {body.pose.translation - around, body.pose.translation + around};
    }
}

std::span<const BodyPair> Crowd::find_pairs() {
    if (scheme_ != CrowdScheme::two_scene) return broadphase_->find_pairs();
    return boxes_.find_pairs(*broadphase_, bodies_.size(), [this](std::uint32_t body) {
        return box_of(bodies_[body].shape, bodies_[body].pose);
    });
}

CrowdTotals Crowd::query() {
    CrowdTotals query{.queries = 1};
    const Stopwatch placing(Clock::wall);
    place_bounds();
    query.boxes_ms = placing.ms();
    const Stopwatch updating(Clock::wall);
    broadphase_->update(bounds_);
    query.update_ms = updating.ms();
    const Stopwatch querying(Clock::wall);
    for (const BodyPair& pair : find_pairs()) {
        ++query.pairs;
        const Body& a = bodies_[pair.a];
        const Body& b = bodies_[pair.b];
        query.touching += test_contact(a.shape, a.pose, b.shape, b.pose).is_touching ? 1u : 0u;
    }
    query.query_ms = querying.ms();
    query.candidates = broadphase_->candidate_count();
    query.boxes = is_of_cubes(scheme_) ? boxes_.computed_count() : bodies_.size();
    if (query.touching == 0) return query;
    query.positive_queries = 1;
    query.positive_ms = query.query_ms;
    return query;
}

void CrowdTotals::add(const CrowdTotals& other) {
    queries += other.queries;
    positive_queries += other.positive_queries;
    query_ms += other.query_ms;
    positive_ms += other.positive_ms;
    boxes_ms += other.boxes_ms;
    update_ms += other.update_ms;
    boxes += other.boxes;
    pairs += other.pairs;
    touching += other.touching;
    candidates += other.candidates;
}

CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on) {
    CrowdTotals totals;
    do {
        totals.add(crowd.query());
        crowd.move(dt);
    } while (goes_on(totals));
    return totals;
}

}  // namespace terrane::tools
