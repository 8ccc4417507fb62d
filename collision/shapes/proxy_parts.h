// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "base/vector_math.h"

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A triangle mesh with distance queries and, if it is closed, an interior.
struct SolidMesh {
    using Triangle = std::array<std::uint32_t, 3>;

    std::vector<Eigen::Vector3d> points;  ///< no two equal
    std::vector<Triangle> triangles;      ///< three different points each
    std::vector<AabbNode> tree;           ///< of the triangles' boxes
    bool is_closed = false;  ///< triangles traverse every edge equally often in both directions
    double extent = 0.0;     ///< largest side of the box around the points, metres

    std::array<Eigen::Vector3d, 3> corners(std::uint32_t triangle) const {
        const Triangle& t = triangles[triangle];
        return {points[t[0]], points[t[1]], points[t[2]]};
    }
};

/// Welds equal positions and drops degenerate triangles: those of which two corners have the same position.
///
/// @param mesh finite, with valid indices
SolidMesh make_solid_mesh(const TriangleMesh& mesh);

/// The nearest triangle and its distance.
struct NearestTriangle {
    std::uint32_t triangle = 0;
    double distance = kInfinity;
};

/// The nearest triangle to a point; of several, the one with the lowest index.
NearestTriangle find_nearest(const SolidMesh& mesh, const Eigen::Vector3d& p);

/// Whether the winding number of a closed mesh about a point is not 0. Arbitrary for points on the surface.
bool is_inside(const SolidMesh& mesh, const Eigen::Vector3d& p);

/// Signed volume, m^3: negative if the triangles are wound inside out.
double signed_volume(const SolidMesh& mesh);

/// Bounds of the one-sided Hausdorff distance from a hull to a solid.
struct HullDistance {
    double low = 0.0;   ///< distance of `place` from the solid, metres: the largest found
    double high = 0.0;  ///< certified upper bound, metres
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< a point of the hull
    std::size_t pieces = 0;                           ///< number of sub-triangles created
};

/// Bounds the distance by branch and bound over the hull's faces. Stops when `high` is at most max(enough, low +
/// precision), when `low` exceeds `too_much`, or after a fixed number of sub-triangles.
HullDistance distance_outside(const SolidMesh& solid, const ConvexHull& hull, double enough,
                              double precision, double too_much);

/// Distance from a point to a hull, metres; 0 inside. Not below the exact distance, except for rounding.
double distance_to_hull(const ConvexHull& hull, const Eigen::Vector3d& p);

/// Volume of a hull, m^3; 0 for a flat one.
double volume_of(const ConvexHull& hull);

/// A convex piece of a proxy.
struct ProxyPart {
    ConvexHull hull;
    Aabb bounds;            ///< of the hull
    double volume = 0.0;    ///< m^3
    HullDistance distance;  ///< of the hull from the solid
};

/// The hull of points, as a part. Does not set its distance.
///
/// Fails: as ConvexHull::create()
Result<ProxyPart> make_part(std::span<const Eigen::Vector3d> points);

/// Covers a closed solid with hulls: cuts it by axis-aligned planes and replaces each piece by its hull, until no hull
/// protrudes from the solid by more than `error` or there are `max_parts` hulls.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> cut_to_parts(const SolidMesh& solid, double error,
                                            std::size_t max_parts);

/// Merges pairs of parts into their common hull, in the order of the volume that the hull adds. First merges pairs
/// whose common hull protrudes from the solid by at most `error`. Then, whatever the error, merges until at most
/// `max_parts` are left. Parts contained in another part are dropped.
///
/// Fails: as ConvexHull::create()
Result<std::vector<ProxyPart>> merge_parts(const SolidMesh& solid, std::vector<ProxyPart> parts,
                                           double error, std::size_t max_parts);

/// A hull of a subset of another hull's vertices.
struct ReducedHull {
    ConvexHull hull;
    double distance = 0.0;  ///< upper bound: from omitted vertices to the hull, metres
};

/// Chooses vertices of a hull one by one, each the farthest from the hull of those already chosen, until none is
/// farther than `error` or `max_vertices` (at least four) are chosen. The result lies inside the given hull.
ReducedHull reduce_hull(const ConvexHull& hull, double error, std::size_t max_vertices);

/// Lower bound of the error of every proxy whose hulls are made from these parts: each part lies inside one hull, and
/// vertices of the hulls may then be omitted. Metres; 0 if no bound is known.
double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts);

}  // namespace terrane::internal
