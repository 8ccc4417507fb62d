// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/math.h>

#include <vector>

namespace terrane::tools {

/// Rectangles that together hold a straight way's footprint, `reach` to each side, in its order: what
/// is not over the extent is left out, and each piece of the way is at most `side` long.
std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent);

/// How far a point's place in the plane is from a rectangle; 0 inside.
double distance_beside(const WorldPos& p_world, const WorldRect& rect);

}  // namespace terrane::tools
