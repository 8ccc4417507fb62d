// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Whether check(shape) succeeds, the pose is finite, and the rotation is orthonormal to 1e-6 with determinant 1.
bool is_valid_query(const Shape& shape, const Pose& pose);

}  // namespace terrane::internal
