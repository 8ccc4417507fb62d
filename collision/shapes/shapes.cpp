// SPDX-License-Identifier: MIT
#include <terrane/collision/shapes.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace terrane {
namespace {

constexpr double kLargestSize = 1e5;  // metres; beyond it tolerances of 1e-9 m mean nothing

Result<void> check_size(const char* name, double value) {
    if (value >= 0.0 && value <= kLargestSize) return {};  // false for NaN
    char text[160];
    std::snprintf(text, sizeof text, "%s must be 0 to 1e5 m, got %.6g", name, value);
    return fail(ErrorCode::invalid_argument, text);
}

Result<void> check(const Sphere& sphere) { return check_size("sphere radius", sphere.radius); }

Result<void> check(const Capsule& capsule) {
    if (Result<void> radius = check_size("capsule radius", capsule.radius); !radius) return radius;
    return check_size("capsule half_height", capsule.half_height);
}

Result<void> check(const Box& box) {
    const Eigen::Vector3d& half = box.half_extents;
    if (Result<void> x = check_size("box half_extents x", half.x()); !x) return x;
    if (Result<void> y = check_size("box half_extents y", half.y()); !y) return y;
    return check_size("box half_extents z", half.z());
}

double bounding_radius(const Sphere& sphere) { return sphere.radius; }
double bounding_radius(const Capsule& capsule) { return capsule.radius + capsule.half_height; }
double bounding_radius(const Box& box) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::sqrt(half.x() * half.x() + half.y() * half.y() + half.z() * half.z());
}

double smallest_half_extent(const Sphere& sphere) { return sphere.radius; }
double smallest_half_extent(const Capsule& capsule) { return capsule.radius; }
double smallest_half_extent(const Box& box) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::min({half.x(), half.y(), half.z()});
}

double support_distance(const Sphere& sphere, const Eigen::Vector3d&) { return sphere.radius; }
double support_distance(const Capsule& capsule, const Eigen::Vector3d& direction_body) {
    return capsule.radius + capsule.half_height * std::abs(direction_body.z());
}
double support_distance(const Box& box, const Eigen::Vector3d& direction_body) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::abs(direction_body.x()) * half.x() + std::abs(direction_body.y()) * half.y() +
           std::abs(direction_body.z()) * half.z();
}

}  // namespace

// Dispatch to the functions of the alternatives: above, and those of convex_hull.h and compound.h.
Result<void> check(const Shape& shape) {
    return std::visit([](const auto& each) { return check(each); }, shape);
}

double bounding_radius(const Shape& shape) {
    return std::visit([](const auto& each) { return bounding_radius(each); }, shape);
}

double smallest_half_extent(const Shape& shape) {
    return std::visit([](const auto& each) { return smallest_half_extent(each); }, shape);
}

double default_contact_tolerance(const Shape& shape) {
    return std::min(0.01, 0.1 * smallest_half_extent(shape));
}

double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body) {
    return std::visit([&](const auto& each) { return support_distance(each, direction_body); },
                      shape);
}

}  // namespace terrane
