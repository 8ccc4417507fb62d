// SPDX-License-Identifier: MIT
#pragma once

#include "support/meshes/shapes.h"

#include <cstddef>

namespace terrane::bench {

/// How far two surfaces are from each other, measured on samples of both.
struct SurfaceMeasure {
    double hausdorff = 0.0;      ///< largest distance of a sample of either from the other, metres
    double mean_distance = 0.0;  ///< over the area of both, metres
    double mean_normal_deg =
        0.0;  ///< angle to the normal at the nearest place of the other, over the area of both
    double max_normal_deg = 0.0;  ///< the largest such angle, degrees
    /// Triangles of the result near whose middle, within `hausdorff`, none of the input faces the same half-space.
    std::size_t flipped = 0;
    std::size_t folded =
        0;  ///< pairs of triangles of the result that lie on each other: at an edge, or all corners
    std::size_t degenerate = 0;  ///< triangles of the result lower than 1e-6 of their longest edge
};

/// Compares a result with its input by samples spread evenly over both areas, and all vertices. Of nearest triangles
/// at the same distance the one counts whose normal is nearest.
///
/// @param samples of each surface, about
SurfaceMeasure measure_surfaces(const test::ShapeMesh& input, const test::ShapeMesh& result,
                                std::size_t samples);

}  // namespace terrane::bench
