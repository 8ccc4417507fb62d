// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/math.h>

#include <vector>

namespace terrane::tools {

/// Rectangles that cover the part of a segment above the extent, with `reach` to each side, in order along it. Each
/// rectangle covers a piece of at most `side` metres.
std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent);

/// Horizontal distance of a point from a rectangle; 0 inside.
double distance_beside(const WorldPos& p_world, const WorldRect& rect);

}  // namespace terrane::tools
