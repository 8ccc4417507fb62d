// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"
#include "shapes/polyhedron.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Translations d with normal . d >= depth: after such a translation, two convex sets are separated along the normal.
struct HalfSpace {
    Eigen::Vector3d normal;  ///< unit
    double depth;            ///< metres
};

/// Up to kMost half-spaces, in the order in which they were added.
struct HalfSpaces {
    static constexpr std::size_t kMost = 48;
    std::array<HalfSpace, kMost> planes;
    std::size_t count = 0;

    /// Appends a plane; drops the oldest one if full.
    void add(const HalfSpace& plane);
};

/// Finds the shortest translation inside all half-spaces. False if their intersection is empty.
bool find_shortest(const HalfSpaces& spaces, Eigen::Vector3d& d_out);

// The shapes of a pair in world axes, relative to an origin near both.

struct PlacedSphere {
    Eigen::Vector3d centre;
    double radius = 0.0;
};

struct PlacedCapsule {
    Eigen::Vector3d centre;
    Eigen::Vector3d half_axis;  ///< from the centre to the end at +z of the body frame
    double radius = 0.0;
    double half_length = 0.0;  ///< of `half_axis`, so that tests for contact take no root
};

struct PlacedBox {
    Eigen::Vector3d centre;
    Eigen::Matrix3d rotation;  ///< orthonormal
    Eigen::Vector3d half;
};

struct PlacedHull {
    Eigen::Vector3d centre;    ///< origin of the body frame
    Eigen::Matrix3d rotation;  ///< orthonormal
    Polyhedron shape;          ///< body frame
    double reach = 0.0;        ///< largest distance of a vertex from the centre
};

/// A convex shape as GJK and the separating axis search use it: the Minkowski sum of a ball and a polyhedron, segment
/// or point.
struct Core {
    Polyhedron shape;  ///< body frame
    Eigen::Matrix3d rotation;
    Eigen::Vector3d centre;
    double radius = 0.0;
    double reach = 0.0;  ///< largest distance of a vertex from the centre

    Eigen::Vector3d to_axes(const Eigen::Vector3d& v_body) const {
        return rotated(rotation, v_body);
    }
    Eigen::Vector3d to_body(const Eigen::Vector3d& v) const { return rotated_back(rotation, v); }
    Eigen::Vector3d vertex(std::uint32_t i) const { return to_axes(shape.vertices[i]) + centre; }
};

/// Storage that cores point into; it must outlive them and must not move.
struct CoreStorage {
    std::array<Eigen::Vector3d, 2> ends;
    BoxStorage box;
};

Core make_core(const PlacedSphere& sphere, CoreStorage& storage_out);
Core make_core(const PlacedCapsule& capsule, CoreStorage& storage_out);
Core make_core(const PlacedBox& box, CoreStorage& storage_out);
Core make_core(const PlacedHull& hull, CoreStorage& storage_out);

/// Lengths below this fraction of the shapes' sizes count as rounding.
inline constexpr double kTouchShare = 1e-12;

/// Distance up to which two cores touch, metres.
inline double touch_of(const Core& a, const Core& b) {
    return kTouchShare * (a.reach + b.reach + a.radius + b.radius);
}

/// Nearest points of two cores, without their radii.
struct Closest {
    Eigen::Vector3d on_a;
    Eigen::Vector3d on_b;
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< from b to a; arbitrary if the cores overlap
    double distance = 0.0;         ///< between the two points; 0 if the cores overlap
    double lower = 0.0;            ///< lower bound of `distance`, certified by a separating plane
};

/// Finds the nearest points of two cores (GJK).
/// @param enough stops once the distance is proved larger
Closest find_closest(const Core& a, const Core& b,
                     double enough = std::numeric_limits<double>::infinity());

/// Nearest points p + s u and q + t v of the segments p to p + u and q to q + v; s and t are 0 to 1.
struct SegmentPair {
    double s = 0.0;
    double t = 0.0;
};
SegmentPair find_closest_on_segments(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& q, const Eigen::Vector3d& v);

/// A direction and the gap of two cores along it, without their radii.
struct Axis {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from b towards a
    /// Minimum of a minus maximum of b along the normal, metres; minus infinity: no axis.
    double gap = -std::numeric_limits<double>::infinity();
};

/// The axis with the largest gap among the facet normals of the Minkowski difference: face normals of both, and cross
/// products of edges whose Gauss map arcs cross. If the cores overlap, minus the gap is the length of their minimum
/// translation; otherwise the gap is at most their distance. There is no axis if the difference has no facet, as for
/// points and parallel segments.
///
/// @param enough stops at the first gap above it
///
/// Cost: O(faces * cost of find_extreme() + pairs of edges that form a facet)
Axis find_separating_axis(const Core& a, const Core& b,
                          double enough = std::numeric_limits<double>::infinity());

/// The gap of two cores along a unit normal from b towards a, without their radii, metres.
double gap_along(const Core& a, const Core& b, const Eigen::Vector3d& normal);

}  // namespace terrane::internal
