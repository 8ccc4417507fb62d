// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/polygon.h>

namespace terrane::internal {

/// A polygon that is asked for distances. Threads: any number.
class PolygonDistance {
public:
    /// Requires a polygon that check() accepts.
    explicit PolygonDistance(Polygon polygon);

    /// Box around the corners, metres.
    const WorldRect& box() const { return box_; }
    /// Whether a place is inside, or on an edge.
    bool contains(double x, double y) const;
    /// Distance of a place, metres: 0 inside. At least `most` where it is found early that it is farther away.
    double at(double x, double y, double most) const;
    /// Bound of the rounding of a distance around the polygon, metres.
    double rounding() const { return rounding_; }

private:
    bool is_inside(double x, double y) const;

    Polygon polygon_;
    WorldRect box_;
    double rounding_ = 0.0;
};

}  // namespace terrane::internal
