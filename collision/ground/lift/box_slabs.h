// SPDX-License-Identifier: MIT
#pragma once

#include "math/vector_math.h"
#include "ground/frame/local_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrane::internal {

/// What the faces of a box leave of a vertical: what lies between each two planes of a slab. Faces that stand
/// upright, or nearly, are sides and leave all of it or nothing.
class BoxSlabs {
public:
    struct Slab {
        double low, high;  ///< z of its planes over x = 0, metres
        double x, y;       ///< their slopes, metres a unit
    };

    /// @param origin where x and y are counted from; its z is not looked at
    /// @param unit   of x and y, metres
    BoxSlabs(const LocalShape& box, const Eigen::Vector3d& origin, double unit) {
        const Eigen::Vector3d centre = box.centre - origin;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d n = box.up(i);
            const double half = box.half[static_cast<Eigen::Index>(i)];
            const double level = -n[0] * centre[0] - n[1] * centre[1];
            if (n[2] < 1e-12) {
                sides_[side_count_++] = {level, n[0] * unit, n[1] * unit, half};
                slabs_[i] = {-kInfinity, kInfinity, 0.0, 0.0};
                continue;
            }
            const double grade = 1.0 / n[2];
            slabs_[i] = {box.centre[2] - (half + level) * grade,
                         box.centre[2] + (half - level) * grade, -n[0] * grade * unit,
                         -n[1] * grade * unit};
        }
    }

    /// The slabs along a line of constant y.
    std::array<Slab, 3> along(double y) const {
        std::array<Slab, 3> slabs = slabs_;
        for (Slab& slab : slabs) {
            slab.low += slab.y * y;
            slab.high += slab.y * y;
        }
        return slabs;
    }
    /// Where the box begins above x of such a line, if it does, and where it ends.
    static double low(const std::array<Slab, 3>& slabs, double x) {
        return std::max({slabs[0].low + slabs[0].x * x, slabs[1].low + slabs[1].x * x,
                         slabs[2].low + slabs[2].x * x});
    }
    static double high(const std::array<Slab, 3>& slabs, double x) {
        return std::min({slabs[0].high + slabs[0].x * x, slabs[1].high + slabs[1].x * x,
                         slabs[2].high + slabs[2].x * x});
    }
    bool is_between_sides(double x, double y) const {
        for (std::size_t i = 0; i < side_count_; ++i) {
            const Side& side = sides_[i];
            if (std::abs(side.level + (side.x * x + side.y * y)) > side.half) return false;
        }
        return true;
    }

private:
    // |level + x x + y y| <= half
    struct Side {
        double level, x, y, half;
    };

    std::array<Slab, 3> slabs_;
    std::array<Side, 3> sides_;
    std::size_t side_count_ = 0;
};

}  // namespace terrane::internal
