// SPDX-License-Identifier: MIT
//
// Source:    C. Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (closest point on a triangle).
// Deviation: without the regions of the vertices; for a point not over the triangle, all three edges are compared.
#include "base/vector_math.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Smallest ratio of height to longest edge at which the interior of a triangle is tested. The normal that is computed
// for a flatter triangle is mostly rounding error, and no interior point is noticeably nearer than the edges.
constexpr double kLeastShape = 1e-9;
// Rounding error of the distance to a triangle with a ratio of 1, relative to the distance to one of its corners.
constexpr double kRounding = 0x1p-49;

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
    const bool is_over =
        doubled > kLeastShape * longest && dot(normal, cross(b - a, p - a)) >= 0.0 &&
        dot(normal, cross(c - b, p - b)) >= 0.0 && dot(normal, cross(a - c, p - c)) >= 0.0;
    if (is_over) {
        return std::abs(dot(normal, p - a)) / doubled +
               kRounding * length(p - a) * (longest / doubled);
    }
    return std::min(
        {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

}  // namespace terrane::internal
