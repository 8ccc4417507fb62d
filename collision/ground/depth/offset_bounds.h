// SPDX-License-Identifier: MIT
#pragma once

#include "ground/lift/ground_lift.h"
#include "math/half_spaces.h"

#include <array>

// What single columns say about the lift of a body over a triangle of sideways offsets. A column and a convex shape
// are both convex: the lift of one over the other is concave over the offsets at which they overlap in plan.
namespace terrane::internal {

/// A sideways translation, metres.
struct Offset {
    double x, y;
};

/// Counter-clockwise.
using OffsetTriangle = std::array<Offset, 3>;

/// Which column of the ground, and against which part of a body.
struct ColumnName {
    std::int64_t column, row;
    std::uint32_t part;
    bool is_first;  ///< of the two triangles of the cell

    bool operator==(const ColumnName&) const = default;
};

/// Of the column that decides a finite lift.
ColumnName name_of(const LocalGround& local, const GroundLift& lift);

/// A column and the part of a body that it is against. Stays where it is, because the part may point into it.
class Obstacle {
public:
    Obstacle(const LocalGround& local, const LocalBody& body, const ColumnName& name);
    Obstacle(const Obstacle&) = delete;
    Obstacle& operator=(const Obstacle&) = delete;

    /// Whether the column is ground; else nothing else may be asked.
    bool is_ground() const { return is_ground_; }
    /// Minus infinity where they do not overlap in plan.
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

/// The half-space of translations that are above the plane through heights over a triangle's corners. Every translation
/// over the triangle that frees from a column is in it, where the heights are the lifts over the column, all finite.
/// False where rounding leaves no plane.
bool make_top(const OffsetTriangle& triangle, const std::array<double, 3>& heights,
              HalfSpace& top_out);

/// The half-space that is left of a triangle once the corners at which a column lifts by `high` or more are cut off:
/// every translation over the triangle that is no higher and frees from the column is in it. False where no corner
/// is, or all are.
bool make_rim(const Obstacle& obstacle, const OffsetTriangle& triangle,
              const std::array<double, 3>& lifts, double high, HalfSpace& rim_out);

/// Of the columns around one the top that is highest over a point, among columns under all of a triangle. False where
/// none is above it. A column may end inside a triangle at a wall that is inside the ground: a neighbour goes on.
bool make_top_of_neighbour(const LocalGround& local, const LocalBody& body, const ColumnName& name,
                           const OffsetTriangle& triangle, const Eigen::Vector3d& p,
                           HalfSpace& top_out);

/// The height above which every translation over a triangle is that frees a body, from the lowest ground around; 0
/// where that says nothing.
///
/// @param lowest a point of the body
double find_range_top(const LocalGround& local, const Eigen::Vector3d& lowest,
                      const OffsetTriangle& triangle);

}  // namespace terrane::internal
