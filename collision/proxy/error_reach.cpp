// SPDX-License-Identifier: MIT
//
// Proves that hulls cannot be near a solid.
//
// Let the hull of a part contain a point x, and let a path from x to infinity keep a distance of at least 2 e from the
// solid. A simplified hull omits vertices. If one of them is farther than e from the simplified hull, the error is
// above e. If none is, the simplified hull contains a point y within e of x. The path from y to x and along the first
// path to infinity keeps a distance of at least e from the solid, and crosses the surface of the simplified hull: the
// error is at least e.
//
// Source: J. Hart. Sphere tracing: a geometric method for the antialiased ray tracing of implicit surfaces. The Visual
//         Computer 12(10), 1996 (steps along a ray by the distance, which bounds how near the surface can be).
#include "proxy/error_reach.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
namespace {

constexpr std::size_t kMostParts = 16;  // those with the largest distance from the solid
constexpr int kMostSteps = 64;          // of a ray
// Rounding of hulls and of clipped points, of the extent: ten times of what they promise.
constexpr double kReachRounding = 1e-8;

// Whether a ray keeps a distance from the solid.
bool is_clear(const SolidMesh& solid, Eigen::Vector3d p, const Eigen::Vector3d& direction,
              double clearance) {
    for (int step = 0; step < kMostSteps; ++step) {
        const double distance = find_nearest(solid, p).distance;
        if (!(distance > clearance)) return false;
        // The point is farther away than the solid is long, so the rest of the ray does not approach the solid.
        if (distance > 8.0 * solid.extent) return true;
        p += 0.999 * (distance - clearance) * direction;
    }
    return false;
}

bool has_clear_ray(const SolidMesh& solid, const Eigen::Vector3d& p, double clearance) {
    for (int code = 0; code < 27; ++code) {
        const int x = code % 3 - 1, y = code / 3 % 3 - 1, z = code / 9 - 1;
        const Eigen::Vector3d direction(x, y, z);
        if (code != 13 && is_clear(solid, p, direction / length(direction), clearance)) return true;
    }
    return false;
}

}  // namespace

double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts) {
    std::vector<const HullDistance*> worst;
    for (const ProxyPart& part : parts) worst.push_back(&part.distance);
    std::stable_sort(worst.begin(), worst.end(),
                     [](const HullDistance* a, const HullDistance* b) { return a->low > b->low; });
    worst.resize(std::min(worst.size(), kMostParts));
    double least = 0.0;
    for (const HullDistance* distance : worst) {
        for (const double share : {0.9, 0.5, 0.1}) {
            const double clearance = share * distance->low;
            const double bound = 0.5 * (0.999 * clearance - kReachRounding * solid.extent);
            if (!(bound > least)) break;
            if (has_clear_ray(solid, distance->place, clearance)) least = bound;
        }
    }
    return least;
}

}  // namespace terrane::internal
