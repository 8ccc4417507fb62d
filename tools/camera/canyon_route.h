// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <Eigen/Core>

#include <vector>

namespace terrane::tools {

/// A way along low ground, in the plane: through the valleys of the roughest part of a terrain.
///
/// Smooth enough to be followed with `turn_length` metres for a turn. Where the terrain is shorter
/// than `length`, the ends go on straight.
///
/// @param length wanted, metres, > 0
/// @return points at equal distances of about a hundredth of the turn length or more
///
/// Fails: io where the source cannot be read
/// Cost:  about 50,000 heights
Result<std::vector<Eigen::Vector2d>> find_canyon_route(const HeightSource& source, double length,
                                                       double turn_length);

}  // namespace terrane::tools
