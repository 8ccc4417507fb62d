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
    HullDistance distance;  ///< of the hull's faces from the solid
};

/// Fails: as ConvexHull::create()
Result<ProxyPart> make_part(std::span<const Eigen::Vector3d> points);

/// Covers a closed solid with hulls: cuts it by axis-aligned planes and replaces each piece by its hull, until no hull
/// protrudes from the solid by more than `error` or there are `max_parts`.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> cut_to_parts(const SolidMesh& solid, double error,
                                            std::size_t max_parts);

/// Replaces pairs of parts by their common hull, least added volume first, while the hull protrudes from the solid by
/// at most `error`; then, whatever the error, until at most `max_parts` are left. Parts contained in another one are
/// dropped.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> merge_parts(const SolidMesh& solid, std::vector<ProxyPart> parts,
                                           double error, std::size_t max_parts);

/// A hull of a subset of another hull's vertices.
struct ReducedHull {
    ConvexHull hull;
    double distance = 0.0;  ///< upper bound of the distance of omitted vertices, metres
};

/// Repeatedly adds the vertex farthest outside, until none is farther than `error` or there are `max_vertices`, at
/// least four. The result lies inside the hull.
ReducedHull reduce_hull(const ConvexHull& hull, double error, std::size_t max_vertices);

/// Lower bound of the distance between a mesh and any proxy in which each part lies inside one hull, also after
/// vertices of these hulls are omitted, metres; 0 if no bound is known.
double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts);

}  // namespace terrane::internal
