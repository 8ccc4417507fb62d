// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"

namespace terrane::internal {

/// Whether a unit direction lies in the ground's normal cone at the feature of a triangle that is highest along it: a
/// face has only its own normal; the cone of an edge or a corner has the directions along which no vertex around it is
/// higher. Where the ground ends only face normals count, because its sides are no surface.
bool is_in_normal_cone(const LocalGround& local, const Triangle& triangle,
                       const Eigen::Vector3d& n);

}  // namespace terrane::internal
