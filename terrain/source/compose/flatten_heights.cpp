// SPDX-License-Identifier: MIT
//
// A flat area is a blend with a plane by the mask of a polygon. The plane interpolates itself: its bounds are the
// rounding of its heights.
#include "base/settings_check.h"
#include "source/bounds/mesh_bounds.h"
#include "source/bounds/rounding.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/composed_heights.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane {
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
    // Of a computed deviation.
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
    if (auto ok = check(area.polygon); !ok) return ok;
    constexpr double kMostSlope = 1e3;
    if (auto ok = check_range("height", area.height, -kMostHeight, kMostHeight); !ok) return ok;
    if (auto ok = check_range("slope_x", area.slope_x, -kMostSlope, kMostSlope); !ok) return ok;
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
