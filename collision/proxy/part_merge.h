// SPDX-License-Identifier: MIT
#pragma once

#include "proxy/solid_cells.h"

#include <vector>

namespace terrane::internal {

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

}  // namespace terrane::internal
