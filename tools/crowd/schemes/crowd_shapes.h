// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

#include <cstddef>

namespace terrane::tools {

/// A sphere-like closed mesh: two poles, and rings of corners between them at equal angles.
struct BallMesh {
    int rings = 3;        ///< 2 or more; a ring has 2 * rings corners
    double radius = 1.0;  ///< of the sphere through the corners, metres
    double aspect = 1.0;  ///< >= 1: the mesh is narrower by this across its poles' axis
    bool is_dented =
        false;  ///< every second segment between two meridians has 0.7 of the radius: not convex
};

/// Number of corners of a mesh.
constexpr std::size_t corner_count(const BallMesh& mesh) {
    return 2 * static_cast<std::size_t>(mesh.rings) * static_cast<std::size_t>(mesh.rings) + 2;
}

/// The mesh as a shape around its centre: a hull, or a compound of one hull for each segment where it is dented.
Shape make_ball(const BallMesh& mesh);

}  // namespace terrane::tools
