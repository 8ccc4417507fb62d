// SPDX-License-Identifier: MIT
#pragma once

#include "local_ground.h"
#include "local_shape.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace terrane::internal {

/// Bounds of how low a shape reaches over a rectangle, from what is the same for all rectangles.
class Underside {
public:
    explicit Underside(const LocalShape& shape);

    /// Whether the shape may reach below `z` over the rectangle of a prism.
    bool may_reach(const Prism& prism, double z) const {
        if (shape_.kind != ShapeKind::round) {
            for (std::size_t i = 0; i < count_; ++i) {
                const Plane& plane = planes_[i];
                const double lowest = plane.z +
                                      std::min(plane.x * prism.west, plane.x * prism.east) +
                                      std::min(plane.y * prism.south, plane.y * prism.north);
                if (lowest >= z) return false;
            }
            return true;
        }
        return round_bottom(prism) < z;
    }

private:
    struct Plane {
        double x, y, z;  // z = plane.z + plane.x x + plane.y y
    };

    double round_bottom(const Prism& prism) const;

    const LocalShape& shape_;
    std::array<Plane, LocalHull::kMostPlanes> planes_;
    std::size_t count_ = 0;
    double run_ = 0.0;
    double core_length_ = 0.0;
};

}  // namespace terrane::internal
