// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/part_tree.h"

#include <limits>
#include <vector>

namespace terrane::internal {

/// Shared data of the copies of a Compound.
struct CompoundData {
    std::vector<CompoundPart> parts;
    std::vector<Aabb> bounds;
    std::vector<PartNode> tree;
    double bounding_radius = 0.0;
    double smallest_half_extent = std::numeric_limits<double>::infinity();
};

}  // namespace terrane::internal
