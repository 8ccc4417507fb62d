// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/extremes.h"
#include "math/vector_math.h"

#include <terrane/collision/convex_hull.h>
#include <terrane/collision/shape_feature.h>

#include <array>

namespace terrane::internal {

/// A hull in the axes of the world, seen from the middle of its bounding box.
struct LocalHull {
    /// Its points p have normal . p >= -drop.
    struct Plane {
        Eigen::Vector3d normal;
        double drop;
    };

    const Polyhedron* shape = nullptr;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d middle;  ///< from the body's origin
    Eigen::Vector3d bounds;  ///< half extents of the bounding box
    static constexpr std::size_t kMostPlanes = 8;
    std::array<Plane, kMostPlanes> planes;  ///< faces around the lowest vertex, and some slopes
    std::size_t plane_count = 0;
    std::size_t face_count = 0;  ///< that come first among the planes

    Eigen::Vector3d to_body(const Eigen::Vector3d& n) const { return rotated_back(rotation, n); }
    Eigen::Vector3d vertex(std::uint32_t i) const {
        return rotated(rotation, shape->vertices[i]) - middle;
    }
    /// The vertex that is deepest against a direction of any length.
    std::uint32_t lowest(const Eigen::Vector3d& n) const {
        return find_extreme(*shape, -to_body(n));
    }
    double drop(const Eigen::Vector3d& n) const { return -dot(n, vertex(lowest(n))); }
};

/// @param rotation orthonormal to 1e-6
void make_local_hull(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out);

/// The edge between two vertices; null where they share none. Cost: O(log edges)
const Polyhedron::Edge* find_edge(const Polyhedron& shape, std::uint32_t a, std::uint32_t b);

/// The feature that is deepest against a unit direction and its middle, seen from the hull's; edges and
/// faces count where they are square to the direction within 1e-9.
ShapeFeature find_deepest(const LocalHull& hull, const Eigen::Vector3d& n,
                          Eigen::Vector3d& middle_out);

}  // namespace terrane::internal
