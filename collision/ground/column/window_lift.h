// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"
#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace terrane::internal {

/// Intersection of vertical lines with a box, as the intersection of three slabs between opposite faces. Slabs that are
/// vertical within rounding are sides: they contain a vertical line entirely or not at all.
class BoxSlabs {
public:
    struct Slab {
        double low, high;  ///< z of its planes at x = 0, metres
        double x, y;       ///< slopes of the planes, metres per unit
    };

    /// @param origin origin of x and y; its z is not used
    /// @param unit   unit of x and y, metres
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

    /// The slabs on the line of this y: their z depends on x only.
    std::array<Slab, 3> along(double y) const {
        std::array<Slab, 3> slabs = slabs_;
        for (Slab& slab : slabs) {
            slab.low += slab.y * y;
            slab.high += slab.y * y;
        }
        return slabs;
    }
    /// Lowest and highest z of the box at x, with slabs of along(). If low > high, the vertical line misses the box.
    static double low(const std::array<Slab, 3>& slabs, double x) {
        return std::max({slabs[0].low + slabs[0].x * x, slabs[1].low + slabs[1].x * x,
                         slabs[2].low + slabs[2].x * x});
    }
    static double high(const std::array<Slab, 3>& slabs, double x) {
        return std::min({slabs[0].high + slabs[0].x * x, slabs[1].high + slabs[1].x * x,
                         slabs[2].high + slabs[2].x * x});
    }
    /// Whether a vertical line is inside all vertical slabs.
    bool is_between_sides(double x, double y) const {
        for (std::size_t i = 0; i < side_count_; ++i) {
            const Side& side = sides_[i];
            if (std::abs(side.level + (side.x * x + side.y * y)) > side.half) return false;
        }
        return true;
    }

private:
    // A line at (x, y) is inside if |level + side.x * x + side.y * y| <= half.
    struct Side {
        double level, x, y, half;
    };

    std::array<Slab, 3> slabs_;
    std::array<Side, 3> sides_;
    std::size_t side_count_ = 0;
};

/// Lift of a box whose bounds lie within a window. A lift of at most `floor` need not be found; any lift above `enough`
/// may be returned.
///
/// @param corner  south-western corner of the window, in the frame of the box; z is not used
/// @param spacing of the window's cells, metres
WindowLift find_box_lift(const LocalWindow& window, const Eigen::Vector3d& corner, double spacing,
                         const LocalShape& box, double floor, double enough);

/// Lift of a sphere or capsule over a range of cells inside a window. A lift of at most `floor` need not be found; any
/// lift above `enough` may be returned.
WindowLift find_round_lift(const LocalGround& local, const LocalWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough);

}  // namespace terrane::internal
