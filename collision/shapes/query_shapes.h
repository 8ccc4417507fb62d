// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "shapes/polyhedron.h"

#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>

#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Shared data of the copies of a ConvexHull. Not copyable: `polyhedron` points into it.
struct HullData {
    HullData() = default;
    HullData(const HullData&) = delete;
    HullData& operator=(const HullData&) = delete;

    std::vector<Eigen::Vector3d> vertices;
    std::vector<Polyhedron::Face> faces;
    std::vector<std::uint32_t> loops;
    std::vector<Polyhedron::Edge> edges;
    std::vector<std::uint32_t> first_neighbour;
    std::vector<std::uint32_t> neighbours;
    ClimbTable climb;
    Polyhedron polyhedron;
    double bounding_radius = 0.0;       ///< about the body's origin, metres
    double smallest_half_extent = 0.0;  ///< metres
};

/// Makes a hull. Applied to the vertices of its result, it gives the same bits.
/// @param points finite, 1 to ConvexHull::kMaxPoints
std::shared_ptr<const HullData> make_hull_data(std::span<const Eigen::Vector3d> points);

/// Width: the least extent over all directions, to a relative error of 1e-12; 0 for a flat hull.
///
/// Cost: one find_extreme() per face, and one or two per edge that may give a smaller extent
double compute_width(const Polyhedron& hull);

/// View of a hull for queries; valid while `hull` or a copy of it exists.
const Polyhedron& polyhedron(const ConvexHull& hull);

/// Shared data of the copies of a Compound.
struct CompoundData {
    std::vector<CompoundPart> parts;
    std::vector<Aabb> bounds;
    std::vector<AabbNode> tree;
    double bounding_radius = 0.0;
    double smallest_half_extent = std::numeric_limits<double>::infinity();
};

/// Bounding volume tree of the parts, body frame. Valid while `compound` or a copy of it exists.
std::span<const AabbNode> part_tree(const Compound& compound);

/// Largest component of a motion's rotation vector, radians: a spin of 1e6 rad/s for 10 s.
inline constexpr double kMostRotation = 1e7;

/// Whether a point is within kFarthestPlace of the origin along each axis; false for NaN.
bool is_valid_place(const WorldPos& point_world);
/// Whether validate(shape) succeeds, the place is valid, and the rotation is orthonormal to 1e-6 with determinant 1.
bool is_valid_query(const Shape& shape, const Pose& pose);
/// The same for the start of a motion; also whether its translation is within kFarthestPlace and its rotation within
/// kMostRotation along each axis.
bool is_valid_query(const Shape& shape, const Motion& motion);
/// Whether neighbouring doubles at both ends of a motion are at most a quarter of `tolerance`, metres, apart: a cast
/// cannot resolve gaps that are smaller than the distance of neighbouring doubles.
bool is_resolved(const Motion& motion, double tolerance);

}  // namespace terrane::internal
