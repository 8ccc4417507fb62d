// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"
#include "shapes/extremes.h"

#include <terrane/collision/convex_hull.h>
#include <terrane/collision/shape_feature.h>

#include <array>

namespace terrane::internal {

/// A hull in world axes, relative to the middle of its bounding box.
struct LocalHull {
    /// All points p of the hull have normal . p >= -drop.
    struct Plane {
        Eigen::Vector3d normal;
        double drop;
    };
    /// All points p of the hull have low <= x p.x + y p.y <= high.
    struct Strip {
        double x, y;  ///< not normalised
        double low, high;
    };

    const Polyhedron* shape = nullptr;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d middle;  ///< from the body's origin
    Eigen::Vector3d bounds;  ///< half extents of the bounding box
    static constexpr std::size_t kMostPlanes = 8;
    std::array<Plane, kMostPlanes> planes;  ///< faces around the lowest vertex, then fixed slopes
    std::size_t plane_count = 0;
    std::size_t face_count = 0;  ///< planes that are faces; they come first
    Strip strip;                 ///< that holds the outline seen from above
    bool is_narrow = false;      ///< whether the strip is much narrower than the outline is long

    Eigen::Vector3d to_body(const Eigen::Vector3d& n) const { return rotated_back(rotation, n); }
    Eigen::Vector3d vertex(std::uint32_t i) const {
        return rotated(rotation, shape->vertices[i]) - middle;
    }
    /// The vertex that is farthest against a direction of any length.
    std::uint32_t lowest(const Eigen::Vector3d& n) const {
        return find_extreme(*shape, -to_body(n));
    }
    /// How far the hull reaches against a direction from its middle, times the direction's length.
    double drop(const Eigen::Vector3d& n) const { return -dot(n, vertex(lowest(n))); }
};

/// @param rotation orthonormal to 1e-6
void make_local_hull(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out);

/// The edge between two vertices; null where they share none. Cost: O(log edges)
const Polyhedron::Edge* find_edge(const Polyhedron& shape, std::uint32_t a, std::uint32_t b);

/// The feature that is farthest against a unit direction; an edge or a face where it is perpendicular to the direction
/// within 1e-9.
///
/// @param middle_out of the feature, relative to the hull's middle
ShapeFeature find_deepest(const LocalHull& hull, const Eigen::Vector3d& n,
                          Eigen::Vector3d& middle_out);

}  // namespace terrane::internal
