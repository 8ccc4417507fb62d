// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/result.h>

#include <vector>

namespace terrane {

/// A place in the world's plane, metres.
struct PlanePoint {
    double x = 0.0;  ///< world, east
    double y = 0.0;  ///< world, north
    friend bool operator==(const PlanePoint&, const PlanePoint&) = default;
};

/// An area of the world's plane: its corners in order, either way around, the last one joined to the first. Its edges
/// are part of it. Where edges cross, a place is inside if a ray from it crosses an odd number of them.
struct Polygon {
    std::vector<PlanePoint> corners;  ///< at least 3, finite
};

/// The corners of a rectangle.
Polygon polygon_of(const WorldRect& rect);

/// Fails: invalid_argument, naming the corner, for fewer than 3 corners, or one that is not finite
Result<void> check(const Polygon& polygon);

}  // namespace terrane
