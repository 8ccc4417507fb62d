// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>
#include <terrane/terrain/aabb.h>

namespace terrane::internal {

/// Bounding box of a shape at a pose, world axes, rounded outwards: shapes that queries of shape_pairs.h say touch have
/// boxes that overlap. Of a compound, around the box of its parts in the body frame. NaN where the pose is not finite.
///
/// @param pose the rotation must be orthonormal to 1e-6
///
/// Cost: a support point along six directions for a hull, else constant
Aabb compute_aabb(const Shape& shape, const Pose& world_from_shape);

/// The same for every rotation about the shape's origin.
Aabb compute_rotating_aabb(const Shape& shape, const WorldPos& origin_world);

}  // namespace terrane::internal
