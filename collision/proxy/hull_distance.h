// SPDX-License-Identifier: MIT
#pragma once

#include "proxy/solid_mesh.h"

#include <terrane/collision/convex_hull.h>

namespace terrane::internal {

/// Bounds of the one-sided Hausdorff distance from a hull to a solid.
struct HullDistance {
    double low = 0.0;  ///< distance of `place` to the solid, metres
    double high =
        0.0;  ///< certified: no point of the hull's faces is farther from the solid, metres
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< on the hull
    std::size_t pieces = 0;                           ///< sub-triangles that were made
};

/// Branch and bound over the hull's faces. Ends where `high` is at most max(enough, low + precision), where `low` is
/// above `too_much`, or after a fixed number of triangles.
HullDistance distance_outside(const SolidMesh& solid, const ConvexHull& hull, double enough,
                              double precision, double too_much);

/// The distance from a point to a hull, metres; 0 inside. An upper bound within rounding.
double distance_to_hull(const ConvexHull& hull, const Eigen::Vector3d& p);

/// m^3.
double volume_of(const ConvexHull& hull);

}  // namespace terrane::internal
