// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/math.h>

#include <optional>

namespace terrane::tools {

/// A part of a segment, as fractions of its way.
struct SegmentPart {
    double begin = 0.0;
    double end = 1.0;
};

/// The part of a segment outside of which no point is within a margin of the surface over the extent, by the source's
/// intervals: what a ray need not load. None where there is no such point at all.
///
/// @param margin metres, >= 0, along each axis
///
/// Cost: at most 1022 intervals; a few where the segment leaves the heights of the terrain soon
std::optional<SegmentPart> near_ground(const WorldPos& from_world, const WorldPos& to_world,
                                       const HeightSource& source, double margin);

}  // namespace terrane::tools
