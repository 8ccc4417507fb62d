// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace terrane::internal {

/// Lower bounds of a shape's z over rectangles, from planes and strips that are computed once.
class Underside {
public:
    explicit Underside(const LocalShape& shape);

    /// Whether the shape may reach below `z` over the rectangle of a prism.
    bool may_reach(const CellPrism& prism, double z) const {
        if (shape_.kind != ShapeKind::round) {
            for (std::size_t i = 0; i < count_; ++i) {
                const Plane& plane = planes_[i];
                const double lowest = plane.z +
                                      std::min(plane.x * prism.west, plane.x * prism.east) +
                                      std::min(plane.y * prism.south, plane.y * prism.north);
                if (lowest >= z) return false;
            }
            return !is_beside(prism);
        }
        return round_bottom(prism) < z;
    }

private:
    struct Plane {
        double x, y, z;  // z = plane.z + plane.x x + plane.y y
    };

    void add_strip(const LocalHull::Strip& strip);
    void add_strip_along(double axis_x, double axis_y);
    double round_bottom(const CellPrism& prism) const;
    // Whether a strip separates the shape from a rectangle, seen from above.
    bool is_beside(const CellPrism& prism) const {
        const double x = 0.5 * (prism.west + prism.east) - shape_.centre[0];
        const double y = 0.5 * (prism.south + prism.north) - shape_.centre[1];
        for (std::size_t i = 0; i < strip_count_; ++i) {
            const LocalHull::Strip& strip = strips_[i];
            const double at = strip.x * x + strip.y * y;
            const double reach = 0.5 * (std::abs(strip.x) * (prism.east - prism.west) +
                                        std::abs(strip.y) * (prism.north - prism.south));
            if (at - reach > strip.high || at + reach < strip.low) return true;
        }
        return false;
    }

    const LocalShape& shape_;
    std::array<Plane, LocalHull::kMostPlanes> planes_;
    std::size_t count_ = 0;
    std::array<LocalHull::Strip, 3> strips_;  // that hold the outline, with some slack
    std::size_t strip_count_ = 0;
    double run_ = 0.0;
    double core_length_ = 0.0;
};

}  // namespace terrane::internal
