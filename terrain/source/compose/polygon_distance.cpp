// SPDX-License-Identifier: MIT
//
// Sources:
//   M. Shimrat. Algorithm 112: position of point relative to polygon. Commun. ACM 5(8), 1962 (crossings of a ray).
#include "source/compose/polygon_distance.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {

Polygon polygon_of(const WorldRect& rect) {
    return {{{rect.west, rect.south},
             {rect.east, rect.south},
             {rect.east, rect.north},
             {rect.west, rect.north}}};
}

Result<void> check(const Polygon& polygon) {
    if (polygon.corners.size() < 3) {
        return fail(ErrorCode::invalid_argument, "polygon must have at least 3 corners, got " +
                                                     number_text(polygon.corners.size()));
    }
    for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
        const PlanePoint& corner = polygon.corners[i];
        if (std::isfinite(corner.x) && std::isfinite(corner.y)) continue;
        return fail(ErrorCode::invalid_argument,
                    "polygon.corners[" + number_text(i) + "] must be finite, got " +
                        number_text(corner.x) + ", " + number_text(corner.y));
    }
    return {};
}

namespace internal {
namespace {

// Square of the distance of a place from the segment between two corners.
double square_to_segment(const PlanePoint& from, const PlanePoint& to, double x, double y) {
    const double dx = to.x - from.x, dy = to.y - from.y;
    const double px = x - from.x, py = y - from.y;
    const double square = dx * dx + dy * dy;
    const double t = square > 0.0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
    const double ox = px - t * dx, oy = py - t * dy;
    return ox * ox + oy * oy;
}

}  // namespace

PolygonDistance::PolygonDistance(Polygon polygon) : polygon_(std::move(polygon)) {
    const PlanePoint& first = polygon_.corners.front();
    box_ = {first.x, first.y, first.x, first.y};
    for (const PlanePoint& corner : polygon_.corners) {
        box_.west = std::min(box_.west, corner.x);
        box_.south = std::min(box_.south, corner.y);
        box_.east = std::max(box_.east, corner.x);
        box_.north = std::max(box_.north, corner.y);
    }
    rounding_ = 0x1p-48 * std::max({std::abs(box_.west), std::abs(box_.south), std::abs(box_.east),
                                    std::abs(box_.north)});
}

// Each edge counts with its lower end and without its upper one.
bool PolygonDistance::is_inside(double x, double y) const {
    bool inside = false;
    PlanePoint from = polygon_.corners.back();
    for (const PlanePoint& to : polygon_.corners) {
        if ((from.y <= y) != (to.y <= y)) {
            const double at = from.x + (y - from.y) / (to.y - from.y) * (to.x - from.x);
            if (at > x) inside = !inside;
        }
        from = to;
    }
    return inside;
}

bool PolygonDistance::contains(double x, double y) const { return at(x, y, 1.0) == 0.0; }

double PolygonDistance::at(double x, double y, double most) const {
    const double beside_x = std::max({box_.west - x, x - box_.east, 0.0});
    const double beside_y = std::max({box_.south - y, y - box_.north, 0.0});
    if (beside_x >= most || beside_y >= most) return std::max(beside_x, beside_y);
    if (beside_x == 0.0 && beside_y == 0.0 && is_inside(x, y)) return 0.0;
    PlanePoint from = polygon_.corners.back();
    double least = square_to_segment(from, polygon_.corners.front(), x, y);
    for (const PlanePoint& to : polygon_.corners) {
        least = std::min(least, square_to_segment(from, to, x, y));
        from = to;
    }
    return std::sqrt(least);
}

}  // namespace internal
}  // namespace terrane
