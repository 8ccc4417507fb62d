// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"
#include "ground/frame/window_features.h"

#include <algorithm>
#include <limits>

namespace terrane::internal {

/// Lower bounds of the times at which a moving, turning part comes within the tolerance of static boxes and planes.
/// Times are fractions of the motion, from now.
class Approach {
public:
    static constexpr double kNever = std::numeric_limits<double>::infinity();

    struct Interval {
        double first;
        double last;
    };

    /// @param shape         at its current pose; outlives this
    /// @param velocity      metres per whole motion
    /// @param turning       upper bound of the speed of its points from turning, metres per whole motion
    /// @param tolerance     metres
    /// @param ground_offset the ground counts as lower by this, metres
    Approach(const LocalShape& shape, const Eigen::Vector3d& velocity, double turning,
             double tolerance, double ground_offset)
        : shape_(shape),
          velocity_(velocity),
          turning_(turning),
          tolerance_(tolerance),
          ground_offset_(ground_offset) {
        if (shape.kind != ShapeKind::round) return;
        // The upward normal perpendicular to the core: along it the shape reaches only its radius below the centre.
        const double square = dot(shape.core, shape.core);
        const double level = square - shape.core[2] * shape.core[2];
        if (!(level > 1e-2 * square)) return;
        const double size = std::sqrt(square * level);
        along_ = {-shape.core[2] * shape.core[0] / size, -shape.core[2] * shape.core[1] / size,
                  level / size};
    }

    double tolerance() const { return tolerance_; }
    double ground_offset() const { return ground_offset_; }

    /// The interval in which it may be over the strip between two coordinates of an axis.
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
    /// The time at which it may reach down to a height.
    double down_to(double z) const {
        return time_of(shape_.centre[2] - shape_.bounds[2] - z + ground_offset_, -velocity_[2]);
    }
    /// The time at which its AABB may meet a prism.
    double time_to(const CellPrism& prism) const {
        return std::max({over(0, prism.west, prism.east).first,
                         over(1, prism.south, prism.north).first, down_to(prism.high)});
    }
    /// Whether it may meet a prism before a time, by the planes below it.
    bool may_meet(const CellPrism& prism, double before) const {
        bool may_be = true;
        const auto take = [&](const Eigen::Vector3d& n, double drop) {
            const double top = std::max(n[0] * (prism.west - shape_.centre[0]),
                                        n[0] * (prism.east - shape_.centre[0])) +
                               std::max(n[1] * (prism.south - shape_.centre[1]),
                                        n[1] * (prism.north - shape_.centre[1])) +
                               n[2] * (prism.high - shape_.centre[2]);
            may_be =
                may_be && time_of(ground_offset_ * n[2] - top - drop, -dot(n, velocity_)) < before;
        };
        if (along_[2] > 0.0) take(along_, shape_.radius);
        visit_down_planes(shape_, take);
        return may_be;
    }

private:
    // Time in which a gap shrinks to the tolerance, closing at `speed` and by turning.
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

/// Visits the cells of a range that a window holds, all of them ground, in the order in which the bounds of a part meet
/// them, until the next is met no sooner than the best hit so far. The visitor has
///   double limit()                   the time of the best hit so far
///   bool wants(const CellPrism&)     whether to visit what is inside
///   void take(const Triangle&, const Approach::Interval& over)   `over`: when the part is over its cell
/// Returns the bounding range of the cells visited.
template <class Visitor>
CellRange visit_soonest(const LocalGround& local, const GroundWindow& window,
                        const CellRange& cells, const Approach& approach, Visitor& visitor) {
    constexpr auto kMost = static_cast<std::size_t>(GroundWindow::kMostCells);
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
        // A linear scan: few cells are left after the first hit.
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
        visitor.take(local.triangle(window, cell.column, cell.row, true), cell.over);
        visitor.take(local.triangle(window, cell.column, cell.row, false), cell.over);
    }
}

}  // namespace terrane::internal
