// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"

#include <terrane/collision/compound.h>

#include <limits>
#include <vector>

namespace terrane::internal {

/// Shared data of the copies of a Compound.
struct CompoundData {
    std::vector<CompoundPart> parts;
    std::vector<Aabb> bounds;
    std::vector<AabbNode> tree;
    double bounding_radius = 0.0;
    double smallest_half_extent = std::numeric_limits<double>::infinity();
};

/// Of the parts' bounds, body frame. Valid as long as `compound` or a copy of it.
std::span<const AabbNode> part_tree(const Compound& compound);

}  // namespace terrane::internal
