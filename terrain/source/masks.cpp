// SPDX-License-Identifier: MIT
//
// Source: M. Shimrat. Algorithm 112: position of point relative to polygon. Commun. ACM 5(8), 1962. (crossings of a
//         ray)
#include "base/settings_check.h"
#include "source/composed_heights.h"
#include "source/mesh_bounds.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/composed_heights.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace terrane {

Polygon polygon_of(const WorldRect& rect) {
    return {{{rect.west, rect.south},
             {rect.east, rect.south},
             {rect.east, rect.north},
             {rect.west, rect.north}}};
}

Result<void> Polygon::validate() const {
    if (corners.size() < 3) {
        return fail(ErrorCode::invalid_argument,
                    "polygon must have at least 3 corners, got " + number_text(corners.size()));
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const PlanePoint& corner = corners[i];
        if (std::isfinite(corner.x) && std::isfinite(corner.y)) continue;
        return fail(ErrorCode::invalid_argument,
                    "polygon.corners[" + number_text(i) + "] must be finite, got " +
                        number_text(corner.x) + ", " + number_text(corner.y));
    }
    return {};
}

namespace internal {
namespace {

// Squared distance of a position from the segment between two corners.
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

// Counts the edges that a ray to the east crosses. Each edge includes its lower end and excludes its upper one.
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

namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// The circumscribed circle of a rectangle. The circle of a square contains the circles of all squares within it,
// because the distance between the centres is at most sqrt 2 times the difference of the half sides.
struct Circle {
    double x, y, radius;
};

Circle circle_around(const WorldRect& rect) {
    const double width = rect.east - rect.west, depth = rect.north - rect.south;
    return {0.5 * (rect.west + rect.east), 0.5 * (rect.south + rect.north),
            0.5 * std::sqrt(width * width + depth * depth) * (1.0 + 0x1p-50)};
}

class FunctionMask final : public BlendMask {
public:
    FunctionMask(std::function<double(double, double)> function, double slope)
        : BlendMask(slope), function_(std::move(function)) {}

    double at(double x, double y) const override {
        return std::clamp(value(x, y), 0.0, 1.0);  // NaN is preserved
    }
    MaskInterval over(const WorldRect& rect) const override {
        const Circle around = circle_around(rect);
        if (!std::isfinite(around.radius)) return {};
        const double middle = value(around.x, around.y);
        if (!std::isfinite(middle)) return {};
        // a function with slope 0 is constant: its interval has no width
        const double reach =
            slope() > 0.0 ? slope() * around.radius + 0x1p-50 * (1.0 + std::abs(middle)) : 0.0;
        return {std::clamp(middle - reach, 0.0, 1.0), std::clamp(middle + reach, 0.0, 1.0)};
    }
    WorldRect support() const override { return {-kFar, -kFar, kFar, kFar}; }

private:
    double value(double x, double y) const {
        try {
            return function_(x, y);
        } catch (...) {
            return std::numeric_limits<double>::quiet_NaN();
        }
    }

    std::function<double(double, double)> function_;
};

// The mask is 1 - t^2 (3 - 2 t) with t = distance / feather, and 0 for t >= 1; its largest slope is 1.5 / feather.
class PolygonMask final : public BlendMask {
public:
    PolygonMask(const Polygon& polygon, double feather)
        : BlendMask(1.5 / feather * (1.0 + 0x1p-40)), polygon_(polygon), feather_(feather) {}

    double at(double x, double y) const override { return value(polygon_.at(x, y, feather_)); }
    MaskInterval over(const WorldRect& rect) const override {
        const Circle around = circle_around(rect);
        if (!std::isfinite(around.radius)) return {};
        const double reach = around.radius + polygon_.rounding();
        const double distance = polygon_.at(around.x, around.y, feather_ + reach);
        return {value(distance + reach), value(std::max(0.0, distance - reach))};
    }
    WorldRect support() const override {
        const WorldRect& box = polygon_.box();
        return {box.west - feather_, box.south - feather_, box.east + feather_,
                box.north + feather_};
    }

private:
    // The mask at a distance; it does not increase with the distance.
    double value(double distance) const {
        const double t = distance / feather_;
        if (!(t < 1.0)) return 0.0;
        return 1.0 - t * t * (3.0 - 2.0 * t);
    }

    internal::PolygonDistance polygon_;
    double feather_;
};

}  // namespace

Result<std::shared_ptr<const BlendMask>> mask_from_function(
    std::function<double(double x, double y)> function, double slope) {
    if (!function) {
        return fail(ErrorCode::invalid_argument,
                    "function must be one that can be called, got an empty one");
    }
    TERRANE_TRY(check_range("slope", slope, 0.0, 1e6));
    return std::make_shared<const FunctionMask>(std::move(function), slope);
}

Result<std::shared_ptr<const BlendMask>> mask_from_polygon(const Polygon& polygon, double feather) {
    TERRANE_TRY(polygon.validate());
    if (!(feather > 0.0) || !std::isfinite(feather)) {
        return fail(ErrorCode::invalid_argument,
                    "feather must be > 0 m, got " + number_text(feather));
    }
    return std::make_shared<const PolygonMask>(polygon, feather);
}

// A flat area is the base blended with a plane by the mask of a polygon. A plane is interpolated exactly, so its bounds
// consist only of the rounding errors of its heights.

namespace {

class Plane final : public HeightSource {
public:
    Plane(const HeightSource& base, const FlatArea& area)
        : HeightSource(base.lattice(), base.extent()),
          first_(area.polygon.corners.front()),
          height_(area.height),
          slope_x_(area.slope_x),
          slope_y_(area.slope_y) {}

    double height(double x, double y) const override {
        return height_ + slope_x_ * (x - first_.x) + slope_y_ * (y - first_.y);
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            const double y = lattice().y(grid.corner.y + row * grid.step);
            for (int column = 0; column < grid.columns; ++column) {
                heights_out[i++] = height(lattice().x(grid.corner.x + column * grid.step), y);
            }
        }
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                bounds_out[i++] = ((row | column) & 1) != 0 ? rounding() : 0.0f;
            }
        }
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& /*grid*/,
                             std::span<float> bounds_out) const override {
        std::ranges::fill(bounds_out, rounding());
        return {};
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const double south_west = height(rect.west, rect.south);
        const double south_east = height(rect.east, rect.south);
        const double north_west = height(rect.west, rect.north);
        const double north_east = height(rect.east, rect.north);
        const auto [low, high] = std::minmax({south_west, south_east, north_west, north_east});
        const double slack = 0x1p-50 * (std::abs(low) + std::abs(high) + std::abs(height_));
        return {low - slack, high + slack};
    }

    double rise_bound(double distance) const override {
        return (std::sqrt(slope_x_ * slope_x_ + slope_y_ * slope_y_) * distance +
                static_cast<double>(rounding())) *
               kOutward;
    }

private:
    // Upper bound of the rounding error of a computed height or deviation.
    float rounding() const {
        const double reach =
            std::max({std::abs(extent().west), std::abs(extent().east), std::abs(extent().south),
                      std::abs(extent().north), std::abs(first_.x), std::abs(first_.y)});
        return round_up(0x1p-50 * (std::abs(height_) +
                                   2.0 * (std::abs(slope_x_) + std::abs(slope_y_)) * reach));
    }

    PlanePoint first_;
    double height_, slope_x_, slope_y_;
};

Result<void> check(const FlatArea& area) {
    TERRANE_TRY(area.polygon.validate());
    constexpr double kMostSlope = 1e3;
    TERRANE_TRY(check_range("height", area.height, -kMostHeight, kMostHeight));
    TERRANE_TRY(check_range("slope_x", area.slope_x, -kMostSlope, kMostSlope));
    return check_range("slope_y", area.slope_y, -kMostSlope, kMostSlope);
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> flatten_heights(
    std::shared_ptr<const HeightSource> base, std::span<const FlatArea> areas) {
    TERRANE_ASSERT(base != nullptr, "flat areas lie in another source");
    for (std::size_t i = 0; i < areas.size(); ++i) {
        const FlatArea& area = areas[i];
        const auto refuse = [i](const Error& error) {
            return fail(error.code, "areas[" + number_text(i) + "]." + error.message);
        };
        if (auto ok = check(area); !ok) return refuse(ok.error());
        auto mask = mask_from_polygon(area.polygon, area.feather);
        if (!mask) return refuse(mask.error());
        auto plane = std::make_shared<const Plane>(*base, area);
        auto flat = blend_heights(std::move(base), std::move(plane), std::move(*mask));
        if (!flat) return refuse(flat.error());
        base = std::move(*flat);
    }
    return base;
}

}  // namespace terrane
