// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/proxy_distance.h"

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <span>
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

/// Replaces pairs of parts by their common hull, the least added volume first, while it stands out of the solid by no
/// more than `error`; then, whatever the error, until no more than `max_parts` are left. Parts
/// that another one contains are left out.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> merge_parts(const SolidMesh& solid, std::vector<ProxyPart> parts,
                                           double error, std::size_t max_parts);

/// A hull of at most `max_vertices` of the vertices.
struct ReducedHull {
    ConvexHull hull;
    double distance = 0.0;  ///< no vertex that was left out is farther from it, metres
};

/// Adds the vertex that is farthest outside, until none is farther than `error` or there are `max_vertices`, at least
/// four. The result is inside the hull.
ReducedHull reduce_hull(const ConvexHull& hull, double error, std::size_t max_vertices);

/// A lower bound of the distance between a mesh and any proxy whose hulls contain the parts, each part in one of them,
/// and of the same after vertices of these hulls are left out: metres, 0 where none is known.
double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts);

}  // namespace terrane::internal
