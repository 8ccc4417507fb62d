// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>

namespace terrane::internal {

/// Triangles as indices of vertices, metres; may be degenerate, open or non-manifold.
struct SurfaceView {
    std::span<const Eigen::Vector3d> vertices = {};
    std::span<const std::array<std::uint32_t, 3>> triangles = {};
};

/// Certified upper bound of the two-sided Hausdorff distance between two surfaces, metres: no point of either is
/// farther from the other. Exceeds the distance by at most a hundredth and 1e-10 of the size of both surfaces, unless
/// the limit of 100 steps for a triangle is reached. Infinity if one of them has no triangles; 0 if neither has.
///
/// Cost: O(n log n), about a query of the nearest triangle for each cell of the overlay of the two surfaces
double bound_surface_distance(const SurfaceView& a, const SurfaceView& b);

}  // namespace terrane::internal
