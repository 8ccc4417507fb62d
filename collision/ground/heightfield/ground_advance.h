// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"
#include "ground/column/ground_lift.h"
#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"
#include "ground/column/window_features.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {

/// Lower bounds of the times at which a moving, turning part comes within the tolerance of static boxes and planes.
/// Times are fractions of the motion, counted from the current pose.
class Approach {
public:
    static constexpr double kNever = std::numeric_limits<double>::infinity();

    struct Interval {
        double first;
        double last;
    };

    /// @param shape         at its current pose; outlives this
    /// @param velocity      metres per whole motion
    /// @param turning       upper bound of the speed of the shape's points due to rotation, metres per whole motion
    /// @param tolerance     metres
    /// @param ground_offset the ground is lowered by this, metres
    Approach(const LocalShape& shape, const Eigen::Vector3d& velocity, double turning,
             double tolerance, double ground_offset)
        : shape_(shape),
          velocity_(velocity),
          turning_(turning),
          tolerance_(tolerance),
          ground_offset_(ground_offset) {
        if (shape.kind != ShapeKind::round) return;
        // The upward normal perpendicular to the core: against it the shape extends only by its radius from the centre.
        const double square = dot(shape.core, shape.core);
        const double level = square - shape.core[2] * shape.core[2];
        if (!(level > 1e-2 * square)) return;
        const double size = std::sqrt(square * level);
        along_ = {-shape.core[2] * shape.core[0] / size, -shape.core[2] * shape.core[1] / size,
                  level / size};
    }

    double tolerance() const { return tolerance_; }
    double ground_offset() const { return ground_offset_; }

    /// The interval of times in which the part may be over the strip between two coordinates along an axis.
    Interval over(Eigen::Index axis, double low, double high) const {
        const double v = velocity_[axis];
        const double from = shape_.centre[axis] - shape_.bounds[axis];
        const double to = shape_.centre[axis] + shape_.bounds[axis];
        Interval when{std::max(time_of(low - to, v), time_of(from - high, -v)), kNever};
        if (v > turning_) {
            when.last = (high - from + tolerance_) / (v - turning_);
        } else if (-v > turning_) {
            when.last = (to - low + tolerance_) / (-v - turning_);
        }
        return when;
    }
    /// Earliest time at which the part may reach down to a height.
    double down_to(double z) const {
        return time_of(shape_.centre[2] - shape_.bounds[2] - z + ground_offset_, -velocity_[2]);
    }
    /// Earliest time at which the part's AABB may touch a prism.
    double time_to(const CellPrism& prism) const {
        return std::max({over(0, prism.west, prism.east).first,
                         over(1, prism.south, prism.north).first, down_to(prism.high)});
    }
    /// Whether the part may touch a prism before a given time, according to the planes that bound the part from below.
    bool may_meet(const CellPrism& prism, double before) const {
        bool may_be = true;
        const auto include = [&](const Eigen::Vector3d& n, double drop) {
            const double top = std::max(n[0] * (prism.west - shape_.centre[0]),
                                        n[0] * (prism.east - shape_.centre[0])) +
                               std::max(n[1] * (prism.south - shape_.centre[1]),
                                        n[1] * (prism.north - shape_.centre[1])) +
                               n[2] * (prism.high - shape_.centre[2]);
            may_be =
                may_be && time_of(ground_offset_ * n[2] - top - drop, -dot(n, velocity_)) < before;
        };
        if (along_[2] > 0.0) include(along_, shape_.radius);
        visit_down_planes(shape_, include);
        return may_be;
    }

private:
    // Time in which a gap shrinks to the tolerance, if it closes at `speed` plus the speed of the rotation.
    double time_of(double gap, double speed) const {
        if (gap <= tolerance_) return 0.0;
        const double closing = speed + turning_;
        return closing > 0.0 ? (gap - tolerance_) / closing : kNever;
    }

    const LocalShape& shape_;
    Eigen::Vector3d velocity_;
    double turning_;
    double tolerance_;
    double ground_offset_;
    Eigen::Vector3d along_ = Eigen::Vector3d::Zero();  // unit, perpendicular to a core; or zero
};

/// Visits cells of a window, which must all be ground, in the order in which a part's AABB may reach them. Stops when
/// the next cell is reached no sooner than the best hit so far. The visitor has
///   double limit()                   the time of the best hit so far
///   bool wants(const CellPrism&)     whether to visit the cell in this prism
///   void visit(const Triangle&, const Approach::Interval& over)   `over`: interval in which the part is over the cell
/// Returns the bounding range of the cells visited.
template <class Visitor>
CellRange visit_soonest(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                        const Approach& approach, Visitor& visitor) {
    constexpr auto kMost = static_cast<std::size_t>(LocalWindow::kMostCells);
    struct Cell {
        double when;
        Approach::Interval over;
        int column;
        int row;
    };
    std::array<Approach::Interval, kMost> over_columns;
    std::array<Cell, kMost * kMost> queue;
    std::size_t count = 0;
    if (!(approach.down_to(window.high) < visitor.limit())) return {};
    const WindowCells at(window, cells);
    for (int i = 0; i <= at.east - at.west; ++i) {
        over_columns[static_cast<std::size_t>(i)] =
            approach.over(0, local.x(cells.west + i), local.x(cells.west + i + 1));
    }
    for (int row = at.south; row <= at.north; ++row) {
        const std::int64_t y = window.cells.south + row;
        const Approach::Interval over_row = approach.over(1, local.y(y), local.y(y + 1));
        if (!(over_row.first < visitor.limit())) continue;
        double at_west = std::max(window.at(at.west, row), window.at(at.west, row + 1));
        for (int column = at.west; column <= at.east; ++column) {
            const Approach::Interval& over_column =
                over_columns[static_cast<std::size_t>(column - at.west)];
            const double at_east =
                std::max(window.at(column + 1, row), window.at(column + 1, row + 1));
            const Approach::Interval over{std::max(over_column.first, over_row.first),
                                          std::min(over_column.last, over_row.last)};
            const double when = std::max(over.first, approach.down_to(std::max(at_west, at_east)));
            at_west = at_east;
            if (!(when < visitor.limit()) || when > over.last) continue;
            queue[count++] = {when, over, column, row};
        }
    }
    CellRange seen;
    while (true) {
        // A linear scan suffices, because few cells are left after the first hit.
        std::size_t next = 0;
        for (std::size_t i = 0; i < count;) {
            if (!(queue[i].when < visitor.limit())) {
                queue[i] = queue[--count];
                continue;
            }
            if (queue[i].when < queue[next].when) next = i;
            ++i;
        }
        if (count == 0) return seen;
        const Cell cell = queue[next];
        queue[next] = queue[--count];
        if (!visitor.wants(local.cell_prism(window, cell.column, cell.row))) continue;
        const std::int64_t x = window.cells.west + cell.column;
        const std::int64_t y = window.cells.south + cell.row;
        seen = seen.east < seen.west ? CellRange{x, y, x, y}
                                     : CellRange{std::min(seen.west, x), std::min(seen.south, y),
                                                 std::max(seen.east, x), std::max(seen.north, y)};
        visitor.visit(local.triangle(window, cell.column, cell.row, true), cell.over);
        visitor.visit(local.triangle(window, cell.column, cell.row, false), cell.over);
    }
}

/// First contact of a translating shape with a column.
struct ColumnEntry {
    double time = std::numeric_limits<double>::infinity();  ///< infinity: none before the limit
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();      ///< unit, out of the column
};

/// Whether a shape with this gap along a wall's normal touches the wall. Two columns may share a wall, and a shape
/// without thickness that moves along the wall is inside the ground although it overlaps neither column. A touched wall
/// therefore separates only shapes that move away from it.
inline bool is_touching_wall(double gap) { return gap >= 0.0 && gap <= kTouch; }

/// Time of first contact of a shape with a column, moved back slightly, so that the gap at the returned time is between
/// 0 and half the tolerance.
///
/// @param velocity      metres per unit of time
/// @param tolerance     metres
/// @param ground_offset the top of the column is lowered by this, metres
/// @param from          shape and column are known to be apart until this time
/// @param limit         contacts at this time or later are ignored
ColumnEntry find_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                       const Triangle& triangle, double tolerance, double ground_offset,
                       double from, double limit);

/// find_entry() for a box.
ColumnEntry find_box_entry(const LocalShape& box, const Eigen::Vector3d& velocity,
                           const Triangle& triangle, double tolerance, double ground_offset,
                           double limit);

// Bounds of the time for which a moving, turning shape cannot meet a column of the ground.

// Largest distance of a shape's points from an axis through its body's origin, metres. For a round shape only its core
// counts, because rotation about the core does not move it.
double find_arm(const LocalShape& shape, const Eigen::Vector3d& axis);

// The motion of a cast; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in);

    // The body at t in a local frame.
    LocalBody at(const LocalGround& local, double t) const {
        return {shape, motion.at(t).rotation,
                local.to_local(motion.start.translation) + t * motion.translation};
    }
    // find_arm() of a part; 0 without rotation.
    double arm_of(const LocalShape& part) const { return spin == 0.0 ? 0.0 : find_arm(part, axis); }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;  ///< radians per whole motion
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    double arm = 0.0;  ///< of the whole body, metres
};

// Lower bound of the time at which the gap between a moving, turning shape and a plane of normal n shrinks to `rest`.
//
// `arm` is find_arm() of the shape, metres.
double bound_time(const Sweep& sweep, const LocalShape& shape, double arm, const Eigen::Vector3d& n,
                  double gap, double rest, double remaining);

// Bounding box of an AABB that is swept by `translation` while rotation moves its points by up to `turned` metres.
struct SweptBox {
    SweptBox(const Eigen::Vector3d& start, const Eigen::Vector3d& bounds_in,
             const Eigen::Vector3d& translation, double turned)
        : centre(start + 0.5 * translation) {
        for (int i = 0; i < 3; ++i)
            bounds[i] = bounds_in[i] + 0.5 * std::abs(translation[i]) + turned;
    }
    double bottom() const { return centre[2] - bounds[2]; }
    CellRange cells(const LocalGround& local) const {
        return local.cells(centre[0] - bounds[0], centre[1] - bounds[1], centre[0] + bounds[0],
                           centre[1] + bounds[1]);
    }

    Eigen::Vector3d centre;
    Eigen::Vector3d bounds;
};

// Result of testing all columns that a body could meet in the rest of a piece of its motion.
struct Advance {
    double step;          ///< no contact before this; initially the rest of the piece
    bool is_hit = false;  ///< there is a hit at `step`
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    std::uint32_t hit_part = 0;
    bool is_missing = false;  ///< ground at `step` is not resident
    double error_m = 0.0;
};

// Tests one part of a body: finds its time of contact if it does not turn, otherwise a conservative step.
class AdvanceVisitor {
public:
    // `arm` is find_arm() of the shape; the ground is lowered by `ground_offset`, metres.
    AdvanceVisitor(const LocalGround& local, const Sweep& sweep, const LocalShape& shape,
                   std::uint32_t part, double arm, double tolerance, double ground_offset,
                   Advance& found)
        : local_(local),
          sweep_(sweep),
          shape_(shape),
          part_(part),
          arm_(arm),
          approach_(shape, sweep.motion.translation, sweep.spin * arm, tolerance, ground_offset),
          found_(found) {}

    // Tests all cells of a range.
    void visit(const CellRange& cells);

    double limit() const { return found_.step; }
    bool wants(const CellPrism& prism) const { return approach_.may_meet(prism, found_.step); }
    void visit(const Triangle& triangle, const Approach::Interval& over);

private:
    // The visitor of visit_cells().
    struct CellVisitor;

    void visit_straight(const Triangle& triangle, const Approach::Interval& over);
    void visit_turning(const Triangle& triangle);
    void hit(double step, const Eigen::Vector3d& normal);

    const LocalGround& local_;
    const Sweep& sweep_;
    const LocalShape& shape_;  // at its current pose
    std::uint32_t part_;
    double arm_;
    Approach approach_;
    Advance& found_;
};

}  // namespace terrane::internal
