// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/math.h>

#include <cstddef>
#include <vector>

namespace terrane::tools {

/// The most pieces that a path is cut into.
inline constexpr std::size_t kMostPathPieces = std::size_t{1} << 20;

/// Rectangles that cover the part of a segment above the extent, with `reach` to each side, in order along it. Each
/// rectangle covers a piece of at most `side` metres; of more than kMostPathPieces the first so many.
std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent);

/// Horizontal distance of a point from a rectangle; 0 inside.
double distance_beside(const WorldPos& p_world, const WorldRect& rect);

}  // namespace terrane::tools
