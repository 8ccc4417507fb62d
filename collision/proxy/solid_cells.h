// SPDX-License-Identifier: MIT
#pragma once

#include "proxy/hull_distance.h"
#include "proxy/solid_mesh.h"

#include <terrane/terrain/aabb.h>
#include <terrane/terrain/result.h>

#include <vector>

namespace terrane::internal {

/// A convex piece of a proxy.
struct ProxyPart {
    ConvexHull hull;
    Aabb bounds;            ///< of the hull
    double volume = 0.0;    ///< m^3
    HullDistance distance;  ///< from the hull's faces to the solid
};

/// Fails: as ConvexHull::create()
Result<ProxyPart> make_part(std::span<const Eigen::Vector3d> points);

/// Hulls that together contain a closed solid: it is cut by planes along the axes, and each piece is replaced by its
/// hull, until no hull stands out by more than `error` or there are `max_parts`.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> cut_to_parts(const SolidMesh& solid, double error,
                                            std::size_t max_parts);

}  // namespace terrane::internal
