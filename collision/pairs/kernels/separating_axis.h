// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"

#include <limits>

namespace terrane::internal {

/// A direction and the gap of two cores along it, without their radii.
struct Axis {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from b towards a
    /// Smallest of a minus largest of b along the normal, metres; minus infinity: no axis.
    double gap = -std::numeric_limits<double>::infinity();
};

/// The axis of the largest gap among the facet normals of the Minkowski difference: face normals of both, and cross
/// products of edges whose Gauss map arcs cross. Overlapping, minus the gap is the length of the min translation of the
/// cores; apart, the gap is at most their distance. There is no axis where the difference has no facet: points and
/// parallel segments.
///
/// @param enough stops at the first gap above it
///
/// Cost: O(faces * support + pairs of edges that form a facet)
Axis find_separating_axis(const Core& a, const Core& b,
                          double enough = std::numeric_limits<double>::infinity());

/// The gap along any unit direction from b towards a.
double gap_along(const Core& a, const Core& b, const Eigen::Vector3d& normal);

}  // namespace terrane::internal
