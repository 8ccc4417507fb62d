// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

namespace terrane::internal {

/// Whether check(shape) passes, the pose is finite, and the rotation orthonormal to 1e-6.
bool is_usable(const Shape& shape, const Pose& pose);

}  // namespace terrane::internal
