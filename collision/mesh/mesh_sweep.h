// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/mesh_contacts.h"

#include <terrane/collision/motion.h>

namespace terrane::internal {

/// Where a moving body that is shrunk by an offset meets the joined surface.
struct MeshSweepAnswer {
    bool is_missing = false;  ///< ground that is not resident may be met first: `fraction` is clear
    bool hit = false;
    double fraction =
        1.0;  ///< of the motion: at no time before does the shrunk body touch a triangle
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< at the hit, from the triangle to the body
    Eigen::Vector3d on_shape_world = Eigen::Vector3d::Zero();  ///< on the shrunk body
    std::uint32_t part = 0;
};

/// Casts a shrunk body along a motion against all triangles, from either side. The body must be separated at the
/// start; where it is not, the fraction is 0. Triangles that it is near to and does not approach do not stop it.
///
/// @param stop_gap a hit is at a distance of at most this, metres, > 0
MeshSweepAnswer sweep_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                           double offset, double stop_gap);

}  // namespace terrane::internal
