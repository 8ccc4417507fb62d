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

/// See bound_surface_distance() of meshes.
double bound_surface_distance(const SurfaceView& a, const SurfaceView& b);

}  // namespace terrane::internal
