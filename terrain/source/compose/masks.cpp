// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "source/compose/polygon_distance.h"

#include <terrane/terrain/composed_heights.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// The circle around a rectangle: squares within a square have circles within its circle, because the distance of the
// centres is at most sqrt 2 times the difference of the half sides.
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
        return std::clamp(value(x, y), 0.0, 1.0);  // NaN stays
    }
    MaskInterval over(const WorldRect& rect) const override {
        const Circle around = circle_around(rect);
        if (!std::isfinite(around.radius)) return {};
        const double middle = value(around.x, around.y);
        if (!std::isfinite(middle)) return {};
        // a constant has no rounding
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

// 1 - t^2 (3 - 2 t) of the distance in feathers: its steepest slope is 1.5 a feather.
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
    // Not increasing with the distance.
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
    if (auto ok = check_range("slope", slope, 0.0, 1e6); !ok) return tl::unexpected(ok.error());
    return std::make_shared<const FunctionMask>(std::move(function), slope);
}

Result<std::shared_ptr<const BlendMask>> mask_from_polygon(const Polygon& polygon, double feather) {
    if (auto ok = check(polygon); !ok) return tl::unexpected(ok.error());
    if (!(feather > 0.0) || !std::isfinite(feather)) {
        return fail(ErrorCode::invalid_argument,
                    "feather must be > 0 m, got " + number_text(feather));
    }
    return std::make_shared<const PolygonMask>(polygon, feather);
}

}  // namespace terrane
