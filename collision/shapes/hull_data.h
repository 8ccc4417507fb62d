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

/// The hull of the result's vertices has the same bits.
/// @param points finite, 1 to ConvexHull::kMaxPoints
std::shared_ptr<const HullData> make_hull_data(std::span<const Eigen::Vector3d> points);

/// Width: the least extent over all directions, to a relative error of 1e-12; 0 for a flat hull.
///
/// Cost: a find_extreme() for each face, and one or two for each edge that may give a smaller extent
double compute_width(const Polyhedron& hull);

/// View of a hull for queries; valid as long as `hull` or a copy of it.
const Polyhedron& polyhedron(const ConvexHull& hull);

}  // namespace terrane::internal
