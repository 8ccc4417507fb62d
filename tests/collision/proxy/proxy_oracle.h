// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/collision_proxy.h>

#include <cstddef>
#include <cstdint>

namespace terrane::test {

/// Largest distances of samples, metres.
struct ProxyDistance {
    double mesh_to_proxy = 0.0;
    double proxy_to_mesh = 0.0;
};

/// Distance from a point to a triangle by a search over barycentric coordinates: slow, and independent of the library.
double slow_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& p);

/// Winding number about a point by the sum of solid angles (van Oosterom and Strackee 1983).
double solid_angle_winding(const TriangleMesh& mesh, const Eigen::Vector3d& p);

/// Measures both distances at random points, uniform by area over the triangles of the mesh and the faces of the parts.
ProxyDistance measure_proxy(const TriangleMesh& mesh, const CollisionProxy& proxy,
                            std::size_t samples, std::uint64_t seed);

}  // namespace terrane::test
