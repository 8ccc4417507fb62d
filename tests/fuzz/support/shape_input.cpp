// SPDX-License-Identifier: MIT
#include "support/shape_input.h"

#include "support/heights/table_ground.h"

#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace terrane::fuzz {
namespace {

constexpr double kMostSize = 8.0;
constexpr int kGrounds = 6;

using HeightFunction = std::function<double(double x, double y)>;

ConvexHull take_hull(Input& input) {
    std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(1 + input.below(12)));
    for (Eigen::Vector3d& point : points) point = input.vector(-kMostSize, kMostSize);
    const Result<ConvexHull> hull = ConvexHull::create(points);
    if (hull) return *hull;
    return ConvexHull::create(std::vector<Eigen::Vector3d>{{0.0, 0.0, 0.0}}).value();
}

ConvexShape take_convex(Input& input, int kind) {
    switch (kind) {
        case 0:
            return Sphere{input.number(0.0, kMostSize)};
        case 1: {
            Capsule capsule;
            capsule.radius = input.number(0.0, kMostSize);
            capsule.half_height = input.number(0.0, kMostSize);
            return capsule;
        }
        case 2:
            return Box{input.vector(0.0, kMostSize)};
        default:
            return take_hull(input);
    }
}

/// A height of a lattice point from 0 to 1 that looks random.
double noise(double x, double y) {
    const double wave = 43'758.547 * (0.129898 * x + 0.78233 * y + 0.0371 * x * y);
    return wave - std::floor(wave);
}

bool every(double x, double cells) { return std::fmod(x, cells) == 0.0; }

std::vector<Ground> make_grounds() {
    const std::array<HeightFunction, kGrounds> heights{
        [](double x, double y) { return 0.25 * x - 0.5 * y; },
        [](double x, double) { return std::floor(x / 4.0) * 0.5; },
        [](double x, double y) { return every(x, 5.0) && every(y, 5.0) ? 3.0 : 0.0; },
        [](double x, double) { return every(x, 8.0) ? 5.0 : 0.0; },
        [](double x, double y) { return every(x, 6.0) && every(y, 6.0) ? -4.0 : 0.0; },
        [](double x, double y) { return noise(x, y); }};
    std::vector<Ground> grounds;
    for (const HeightFunction& height : heights) {
        grounds.push_back(test::make_test_ground(height, 1.0, 1));
    }
    return grounds;
}

}  // namespace

Shape take_shape(Input& input) {
    const int kind = input.below(5);
    if (kind < 4) {
        return std::visit([](auto&& shape) -> Shape { return shape; }, take_convex(input, kind));
    }
    std::vector<CompoundPart> parts;
    for (int count = 1 + input.below(4); count > 0; --count) {
        const ConvexShape shape = take_convex(input, input.below(4));
        parts.push_back({shape, take_pose(input, -kMostSize, kMostSize)});
    }
    const Result<Compound> compound = Compound::create(parts);
    if (compound) return *compound;
    return Sphere{};
}

Shape take_simple_shape(Input& input) {
    constexpr double kLeast = 0.05, kMost = 4.0;
    const int kind = input.below(3);
    if (kind == 0) return Sphere{input.between(kLeast, kMost)};
    const double a = input.between(kLeast, kMost), b = input.between(kLeast, kMost);
    if (kind == 1) return Capsule{a, b};
    return Box{{a, b, input.between(kLeast, kMost)}};
}

Pose take_pose(Input& input, double low, double high) {
    Pose pose;
    pose.rotation = input.rotation();
    pose.translation = input.vector(low, high);
    return pose;
}

Motion take_motion(Input& input, double low, double high, double reach) {
    constexpr double kMostTurn = 4.0;  // radians an axis
    Motion motion;
    motion.start = take_pose(input, low, high);
    motion.translation = input.vector(-reach, reach);
    motion.rotation_vector = input.vector(-kMostTurn, kMostTurn);
    return motion;
}

const Ground& take_ground(Input& input) {
    static const std::vector<Ground> grounds = make_grounds();
    return grounds[static_cast<std::size_t>(input.below(kGrounds))];
}

bool is_finite(const Eigen::Vector3d& v) {
    return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

bool is_unit(const Eigen::Vector3d& v) { return std::abs(v.norm() - 1.0) <= 1e-6; }

}  // namespace terrane::fuzz
