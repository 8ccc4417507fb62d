// SPDX-License-Identifier: MIT
// The point nearest to the origin in an intersection of half-spaces.
//
// Sources:    R. Seidel. Small-dimensional linear programming and convex hulls made easy. Discrete and Computational
//             Geometry 1991 (incremental, one dimension less where a plane is violated).
// Deviations: the objective is the distance from the origin, whose minimum on a plane is the foot of the
//             perpendicular; planes are processed in the order of arrival instead of a random one, for determinism.
#include "math/half_spaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Relative tolerance of the depths: a plane violated by less counts as satisfied.
constexpr double kSlack = 1e-14;

double slack_of(const HalfSpace& plane) { return kSlack * std::max(1e-3, std::abs(plane.depth)); }

// Solves on the line of planes i and j, subject to the first `count` planes.
bool find_on_line(const HalfSpaces& spaces, std::size_t i, std::size_t j, std::size_t count,
                  Eigen::Vector3d& d_out) {
    const HalfSpace& a = spaces.planes[i];
    const HalfSpace& b = spaces.planes[j];
    Eigen::Vector3d along = cross(a.normal, b.normal);
    const double square = dot(along, along);
    if (square < 1e-20) return false;  // parallel: an earlier plane is tighter, or infeasible
    const Eigen::Vector3d foot =
        (a.depth * cross(b.normal, along) + b.depth * cross(along, a.normal)) / square;
    along /= std::sqrt(square);
    double first = -std::numeric_limits<double>::infinity();
    double last = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) {
        if (k == i || k == j) continue;
        const HalfSpace& plane = spaces.planes[k];
        const double rate = dot(plane.normal, along);
        const double rest = plane.depth - dot(plane.normal, foot);
        if (std::abs(rate) < 1e-12) {
            if (rest > slack_of(plane) + 1e-11 * std::abs(plane.depth)) return false;
        } else if (rate > 0.0) {
            first = std::max(first, rest / rate);
        } else {
            last = std::min(last, rest / rate);
        }
    }
    if (first > last) {
        if (first - last > 1e-12) return false;
        first = last = 0.5 * (first + last);
    }
    d_out = foot + std::clamp(0.0, first, last) * along;
    return true;
}

// Solves on plane i, subject to the planes before it.
bool find_on_plane(const HalfSpaces& spaces, std::size_t i, Eigen::Vector3d& d_out) {
    d_out = spaces.planes[i].depth * spaces.planes[i].normal;
    for (std::size_t j = 0; j < i; ++j) {
        const HalfSpace& plane = spaces.planes[j];
        if (dot(plane.normal, d_out) >= plane.depth - slack_of(plane)) continue;
        if (!find_on_line(spaces, i, j, j, d_out)) return false;
    }
    return true;
}

}  // namespace

void HalfSpaces::add(const HalfSpace& plane) {
    if (count == kMost) {
        std::move(planes.begin() + 1, planes.end(), planes.begin());
        --count;
    }
    planes[count++] = plane;
}

bool find_shortest(const HalfSpaces& spaces, Eigen::Vector3d& d_out) {
    d_out = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < spaces.count; ++i) {
        const HalfSpace& plane = spaces.planes[i];
        if (dot(plane.normal, d_out) >= plane.depth - slack_of(plane)) continue;
        if (!find_on_plane(spaces, i, d_out)) return false;
    }
    return true;
}

}  // namespace terrane::internal
