// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/extremes.h"
#include "shapes/hull/face_merge.h"
#include "shapes/polyhedron.h"

#include <terrane/collision/convex_hull.h>

#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// What the copies of a ConvexHull share. Not copied itself: `polyhedron` points into it.
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
    double bounding_radius = 0.0;       ///< around the body's origin, metres
    double smallest_half_extent = 0.0;  ///< metres
};

/// @param points finite, 1 to ConvexHull::kMaxPoints
std::shared_ptr<const HullData> make_hull_data(std::span<const Eigen::Vector3d> points);

/// Twice the smallest half extent: the least of the extents over all directions, to 1e-12 of it.
///
/// Cost: a find_extreme() for each face, and one or two for each edge where that might be less
double compute_width(const Polyhedron& hull);

/// The hull as queries see it; lives as long as `hull` or a copy of it.
const Polyhedron& polyhedron(const ConvexHull& hull);

}  // namespace terrane::internal
