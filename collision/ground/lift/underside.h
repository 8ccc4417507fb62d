// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace terrane::internal {

/// Lower bounds of a shape's z over rectangles, from planes and sides that are computed once.
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

    // A normal of the outline of a box seen from above.
    struct Side {
        double x, y;   // not normalised
        double reach;  // of the box from its centre, times the normal's length, and some slack
    };

    void add_side(double x, double y);
    double round_bottom(const CellPrism& prism) const;
    // Whether an edge of a box's outline separates it from a rectangle, seen from above.
    bool is_beside(const CellPrism& prism) const {
        const double x = 0.5 * (prism.west + prism.east) - shape_.centre[0];
        const double y = 0.5 * (prism.south + prism.north) - shape_.centre[1];
        for (std::size_t i = 0; i < side_count_; ++i) {
            const Side& side = sides_[i];
            const double reach =
                side.reach + 0.5 * (std::abs(side.x) * (prism.east - prism.west) +
                                    std::abs(side.y) * (prism.north - prism.south));
            if (std::abs(side.x * x + side.y * y) > reach) return true;
        }
        return false;
    }

    const LocalShape& shape_;
    std::array<Plane, LocalHull::kMostPlanes> planes_;
    std::size_t count_ = 0;
    std::array<Side, 3> sides_;
    std::size_t side_count_ = 0;
    double run_ = 0.0;
    double core_length_ = 0.0;
};

}  // namespace terrane::internal
