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
    std::snprintf(text, sizeof text, "%s must be 0 to 1e5 m, got %.17g", name, value);
    return fail(ErrorCode::invalid_argument, text);
}

double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

}  // namespace

Result<void> check(const Shape& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        return check_size("sphere radius", sphere->radius);
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        if (Result<void> radius = check_size("capsule radius", capsule->radius); !radius)
            return radius;
        return check_size("capsule half_height", capsule->half_height);
    }
    const Eigen::Vector3d& half = std::get<Box>(shape).half_extents;
    if (Result<void> x = check_size("box half_extents x", half.x()); !x) return x;
    if (Result<void> y = check_size("box half_extents y", half.y()); !y) return y;
    return check_size("box half_extents z", half.z());
}

double bounding_radius(const Shape& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return capsule->radius + capsule->half_height;
    }
    const Eigen::Vector3d& half = std::get<Box>(shape).half_extents;
    return length(half.x(), half.y(), half.z());
}

double smallest_half_extent(const Shape& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) return capsule->radius;
    const Eigen::Vector3d& half = std::get<Box>(shape).half_extents;
    return std::min({half.x(), half.y(), half.z()});
}

double default_contact_tolerance(const Shape& shape) {
    return std::min(0.01, 0.1 * smallest_half_extent(shape));
}

double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return capsule->radius + capsule->half_height * std::abs(direction_body.z());
    }
    const Eigen::Vector3d& half = std::get<Box>(shape).half_extents;
    return std::abs(direction_body.x()) * half.x() + std::abs(direction_body.y()) * half.y() +
           std::abs(direction_body.z()) * half.z();
}

}  // namespace terrane
