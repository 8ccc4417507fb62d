// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

namespace terrane::internal {

/// Whether a unit direction lies in the ground's normal cone at the part of a triangle that is
/// highest along it: a face only takes its own normal; an edge or a corner takes a direction if the
/// triangles around it stay below. Where the ground ends only face normals are taken, because its
/// sides are no surface.
bool is_in_normal_cone(const LocalGround& local, const Triangle& triangle,
                       const Eigen::Vector3d& n);

}  // namespace terrane::internal
