// SPDX-License-Identifier: MIT
//
// Source: C. Ericson. Real-Time Collision Detection. 2005, 5.1.5, as the nearest of plane and edges.
#include "simplify/bounds/surface_distance.h"

#include <cmath>

namespace terrane::internal {
namespace {

// Height over the longest edge, below which a triangle is the same as its edges.
constexpr double kLeastShape = 1e-9;

constexpr double kRoundedUpDistance = 1.0 + 0x1p-40;

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
    const Eigen::Vector3d edge = b - a;
    const double square = dot(edge, edge);
    const double t = square > 0.0 ? std::clamp(dot(p - a, edge) / square, 0.0, 1.0) : 0.0;
    return length(p - (a + t * edge));
}

}  // namespace

double distance_to_triangle(const Eigen::Vector3d& p, const Corners& triangle) {
    const auto& [a, b, c] = triangle;
    const Eigen::Vector3d normal = cross(b - a, c - a);
    const double doubled = length(normal);
    const double longest = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
    // The normal of a needle is rounding: its edges are as near as its inside.
    const bool is_over =
        doubled > kLeastShape * longest && dot(normal, cross(b - a, p - a)) >= 0.0 &&
        dot(normal, cross(c - b, p - b)) >= 0.0 && dot(normal, cross(a - c, p - c)) >= 0.0;
    if (is_over) return std::abs(dot(normal, p - a)) / doubled;
    return std::min(
        {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

double largest_distance(const Corners& from, const Corners& to) {
    double largest = 0.0, size = 0.0;
    for (const Eigen::Vector3d& p : from) {
        largest = std::max(largest, distance_to_triangle(p, to));
        size = std::max(size, length(p - to[0]));
    }
    for (const Eigen::Vector3d& p : to) size = std::max(size, length(p - to[0]));
    return largest * kRoundedUpDistance + size * 0x1p-40;
}

}  // namespace terrane::internal
