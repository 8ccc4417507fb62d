// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/placed_shape.h"

namespace terrane::internal {

struct PartRay : ConvexRay {
    std::uint32_t part = 0;
};

/// The first part that the segment `from` to `from + displacement` meets, in the frame of the placement; of ties the
/// one with the lowest index.
PartRay cast_ray(const PlacedShape& shape, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& displacement);

}  // namespace terrane::internal
