// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <Eigen/Core>

#include <vector>

namespace terrane::internal {

/// A polyline in the plane along low ground: through the valleys of the roughest part of a region of a terrain.
///
/// Smoothed so that a turn takes about `turn_length` metres. Where the region is shorter than `length`, both ends
/// are extended straight.
///
/// @param length metres, > 0
/// @return equidistant points, at least turn_length / 100 apart
///
/// Fails: io where the source cannot be read
/// Cost:  about 50,000 calls of HeightSource::height()
Result<std::vector<Eigen::Vector2d>> find_canyon_route(const HeightSource& source,
                                                       const WorldRect& region, double length,
                                                       double turn_length);

}  // namespace terrane::internal
