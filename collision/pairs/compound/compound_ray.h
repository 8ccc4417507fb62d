// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/placed_shape.h"

namespace terrane::internal {

struct PartRay : ConvexRay {
    std::uint32_t part = 0;
};

/// The first part on the way from `from` along `way`, in the frame of the placement; of several at once
/// the one of the least index.
PartRay cast_ray(const PlacedShape& shape, const Eigen::Vector3d& from, const Eigen::Vector3d& displacement);

}  // namespace terrane::internal
