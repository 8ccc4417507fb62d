// SPDX-License-Identifier: MIT
//
// Sources: R. Horst, H. Tuy. Global optimization. 1996 (a concave function is nowhere below the plane through its
//          values at the corners of a simplex; its superlevel sets are convex).
#include "ground/depth/offset_bounds.h"

#include <algorithm>

namespace terrane::internal {

ColumnName name_of(const LocalGround& local, const GroundLift& lift) {
    const std::array<Eigen::Vector3d, 3>& v = lift.triangle.v;
    const double west = std::min({v[0][0], v[1][0], v[2][0]});
    const double south = std::min({v[0][1], v[1][1], v[2][1]});
    // Two corners of the first triangle of a cell are on its southern side.
    int at_south = 0;
    for (const Eigen::Vector3d& p : v) at_south += p[1] == south ? 1 : 0;
    return {local.column_of(west), local.row_of(south), lift.part, at_south == 2};
}

Obstacle::Obstacle(const LocalGround& local, const LocalBody& body, const ColumnName& name) {
    const GroundCell cell = local.cell(name.column, name.row);
    is_ground_ = cell.status == GroundStatus::ok;
    if (!is_ground_) return;
    triangle_ = local.triangles(cell, name.column, name.row)[name.is_first ? 0 : 1];
    shape_ = body.part(name.part, hull_);
}

bool make_side(const Offset& a, const Offset& b, HalfSpace& side_out) {
    const double x = b.x - a.x, y = b.y - a.y;
    const double size = std::sqrt(x * x + y * y);
    if (!(size > 0.0)) return false;
    side_out.normal = {-y / size, x / size, 0.0};
    side_out.depth = side_out.normal[0] * a.x + side_out.normal[1] * a.y;
    return true;
}

bool make_top(const OffsetTriangle& triangle, const std::array<double, 3>& heights,
              HalfSpace& top_out) {
    const double x1 = triangle[1].x - triangle[0].x, y1 = triangle[1].y - triangle[0].y;
    const double x2 = triangle[2].x - triangle[0].x, y2 = triangle[2].y - triangle[0].y;
    const double area = x1 * y2 - x2 * y1;
    if (!(area > 0.0)) return false;
    const double z1 = heights[1] - heights[0], z2 = heights[2] - heights[0];
    const double slope_x = (z1 * y2 - z2 * y1) / area;
    const double slope_y = (z2 * x1 - z1 * x2) / area;
    const double size = std::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y);
    if (!std::isfinite(size)) return false;
    top_out.normal = Eigen::Vector3d(-slope_x, -slope_y, 1.0) / size;
    top_out.depth = (heights[0] - slope_x * triangle[0].x - slope_y * triangle[0].y) / size;
    return true;
}

bool make_rim(const Obstacle& obstacle, const OffsetTriangle& triangle,
              const std::array<double, 3>& lifts, double high, HalfSpace& rim_out) {
    constexpr int kSteps = 10;  // bisections: to a thousandth of a side
    std::size_t in_count = 0;
    for (const double lift : lifts) in_count += lift >= high ? 1 : 0;
    if (in_count == 0 || in_count == 3) return false;
    // The corner that differs from the other two.
    const bool is_in = in_count == 1;
    std::size_t lone = 0;
    while ((lifts[lone] >= high) != is_in) ++lone;
    const Offset& a = triangle[lone];
    const auto find_rim = [&](const Offset& b) {
        double low = 0.0, above = 1.0;  // shares of the side, from its high corner
        const Offset& from = is_in ? a : b;
        const Offset& to = is_in ? b : a;
        const auto at = [&](double s) {
            return Offset{from.x + s * (to.x - from.x), from.y + s * (to.y - from.y)};
        };
        for (int i = 0; i < kSteps; ++i) {
            const double s = 0.5 * (low + above);
            (obstacle.lift_at(at(s)) >= high ? low : above) = s;
        }
        return at(low);
    };
    // Counter-clockwise around the lone corner.
    const Offset next = find_rim(triangle[(lone + 1) % 3]);
    const Offset last = find_rim(triangle[(lone + 2) % 3]);
    return is_in ? make_side(last, next, rim_out) : make_side(next, last, rim_out);
}

bool make_top_of_neighbour(const LocalGround& local, const LocalBody& body, const ColumnName& name,
                           const OffsetTriangle& triangle, const Eigen::Vector3d& p,
                           HalfSpace& top_out) {
    double most = kTouch;  // by which p is below a top
    bool is_found = false;
    for (int k = 0; k < 18; ++k) {
        const ColumnName beside{name.column + k / 2 % 3 - 1, name.row + k / 6 - 1, name.part,
                                k % 2 == 0};
        if (beside == name) continue;
        const Obstacle obstacle(local, body, beside);
        if (!obstacle.is_ground()) continue;
        std::array<double, 3> lifts;
        bool is_under_all = true;
        for (std::size_t i = 0; i < 3 && is_under_all; ++i) {
            lifts[i] = obstacle.lift_at(triangle[i]);
            is_under_all = std::isfinite(lifts[i]);
        }
        HalfSpace top;
        if (!is_under_all || !make_top(triangle, lifts, top)) continue;
        const double below = top.depth - dot(top.normal, p);
        if (!(below > most)) continue;
        most = below;
        top_out = top;
        is_found = true;
    }
    return is_found;
}

double find_range_top(const LocalGround& local, const Eigen::Vector3d& lowest,
                      const OffsetTriangle& triangle) {
    constexpr std::int64_t kMost = 1024;  // cells along a side
    const auto [west, east] = std::minmax({triangle[0].x, triangle[1].x, triangle[2].x});
    const auto [south, north] = std::minmax({triangle[0].y, triangle[1].y, triangle[2].y});
    // For few cells single columns give better bounds.
    if (east - west < 2.0 * local.spacing() && north - south < 2.0 * local.spacing()) return 0.0;
    const CellRange cells =
        local.cells(lowest[0] + west, lowest[1] + south, lowest[0] + east, lowest[1] + north);
    if (cells.east < cells.west || cells.north < cells.south || cells.east - cells.west >= kMost ||
        cells.north - cells.south >= kMost) {
        return 0.0;
    }
    const RangeAnswer range = local.ground().range(cells);
    if (range.status != GroundStatus::ok || !local.is_all_ground(cells)) return 0.0;
    return std::max(0.0, local.z(range.low) - lowest[2]);
}

}  // namespace terrane::internal
