// SPDX-License-Identifier: MIT
#pragma once

#include "ground/lift/ground_lift.h"
#include "math/half_spaces.h"

#include <array>

// Bounds of the lift of a body over a triangle of sideways offsets, from single columns. A column and a convex shape
// are both convex: the lift of one over the other is concave over the offsets at which they overlap in plan.
namespace terrane::internal {

/// A sideways translation, metres.
struct Offset {
    double x, y;
};

/// A triangle of offsets, counter-clockwise.
using OffsetTriangle = std::array<Offset, 3>;

/// A column of the ground and a part of a body.
struct ColumnName {
    std::int64_t column, row;
    std::uint32_t part;
    bool is_first;  ///< whether it is the first triangle of the cell

    bool operator==(const ColumnName&) const = default;
};

/// The column and the part that decide a finite lift.
ColumnName name_of(const LocalGround& local, const GroundLift& lift);

/// A column as an obstacle of a part of a body. Neither copied nor moved, because the part may point into it.
class Obstacle {
public:
    Obstacle(const LocalGround& local, const LocalBody& body, const ColumnName& name);
    Obstacle(const Obstacle&) = delete;
    Obstacle& operator=(const Obstacle&) = delete;

    /// Whether the column is ground; required by lift_at().
    bool is_ground() const { return is_ground_; }
    /// Lift at an offset, metres; minus infinity where they do not overlap in plan.
    double lift_at(const Offset& at) const {
        LocalShape moved = shape_;
        moved.centre[0] += at.x;
        moved.centre[1] += at.y;
        return compute_column_lift(moved, triangle_);
    }

private:
    bool is_ground_ = false;
    Triangle triangle_;
    LocalHull hull_;
    LocalShape shape_;
};

/// The half-space of translations whose offset lies to the left of the line from a to b. False where they coincide.
bool make_side(const Offset& a, const Offset& b, HalfSpace& side_out);

/// The half-space of translations above the plane through heights over a triangle's corners. Where the heights are the
/// lifts over a column, all finite, every translation over the triangle that separates from the column is in it.
/// False where rounding leaves no plane.
bool make_top(const OffsetTriangle& triangle, const std::array<double, 3>& heights,
              HalfSpace& top_out);

/// The half-space that cuts off the corners of a triangle at which the lift over a column is `high` or more: every
/// translation over the triangle that is no higher and separates from the column is in it. False where it would cut off
/// no corner or all.
bool make_rim(const Obstacle& obstacle, const OffsetTriangle& triangle,
              const std::array<double, 3>& lifts, double high, HalfSpace& rim_out);

/// Among the columns around one that overlap in plan over all of a triangle, the top that is highest over a point p.
/// False where none is above p. Needed where a column ends inside the triangle at a wall to a neighbour.
bool make_top_of_neighbour(const LocalGround& local, const LocalBody& body, const ColumnName& name,
                           const OffsetTriangle& triangle, const Eigen::Vector3d& p,
                           HalfSpace& top_out);

/// A lower bound of the z of every translation over a triangle that separates a body, from the lowest ground under it;
/// 0 where there is none.
///
/// @param lowest a point of the body
double find_range_top(const LocalGround& local, const Eigen::Vector3d& lowest,
                      const OffsetTriangle& triangle);

}  // namespace terrane::internal
