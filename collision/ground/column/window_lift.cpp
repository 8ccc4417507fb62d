// SPDX-License-Identifier: MIT
//
// Lift of a box. The height of the ground minus that of the box's underside is piecewise linear in x and y. Its maximum
// is therefore at a vertex of the ground, at a corner of the box, or where an edge of the box crosses an edge of the
// ground in plan. Edges of the ground lie on four families of lines: constant x, constant y, and, two cells apart,
// constant x - y and constant x + y (see cut_to_north_east()).
#include "ground/column/window_lift.h"

#include "ground/column/column.h"
#include "ground/column/window_features.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

// A point in the coordinates of a window.
struct WindowPoint {
    double x, y;  // cells
    double z;     // metres
};

class BoxScan {
public:
    BoxScan(const LocalWindow& window, const Eigen::Vector3d& corner, double spacing,
            const LocalShape& box, double floor, double enough)
        : window_(window), box_(box), limit_(floor), enough_(enough), slabs_(box, corner, spacing) {
        const double cells = 1.0 / spacing;
        for (std::size_t k = 0; k < 8; ++k) {
            const Eigen::Vector3d p = box.corner(static_cast<int>(k)) - corner;
            corners_[k] = {p[0] * cells, p[1] * cells, box.centre[2] + box.corners[k][2]};
        }
    }

    WindowLift run() {
        make_ranges();
        visit_vertices();
        if (limit_ <= enough_) {
            for (const WindowPoint& point : corners_) visit_corner(point);
            visit_edges();
        }
        const double u = x_ - static_cast<double>(best_.column);
        const double v = y_ - static_cast<double>(best_.row);
        best_.is_south =
            window_.is_cut_to_north_east(best_.column, best_.row) ? u >= v : u + v <= 1.0;
        return best_;
    }

private:
    bool is_more(double lift) const { return lift > limit_; }

    void raise_to(double lift, double x, double y, int column, int row) {
        if (!is_more(lift)) return;
        best_ = {lift, column, row};
        limit_ = lift;
        x_ = x;
        y_ = y;
    }

    // Finds the vertices of the cells under or over the box.
    void make_ranges() {
        double west = corners_[0].x, east = west, south = corners_[0].y, north = south;
        for (const WindowPoint& point : corners_) {
            west = std::min(west, point.x);
            east = std::max(east, point.x);
            south = std::min(south, point.y);
            north = std::max(north, point.y);
        }
        first_column_ = cell_of(west, window_.columns);
        last_column_ = cell_of(east, window_.columns) + 1;
        first_row_ = cell_of(south, window_.rows);
        last_row_ = cell_of(north, window_.rows) + 1;
    }

    // Lift at vertices of the ground: the vertical line through each vertex is clipped by the slabs of the box.
    void visit_vertices() {
        const double lowest = box_.centre[2] - box_.bounds[2];
        for (int row = first_row_; row <= last_row_ && limit_ <= enough_; ++row) {
            const auto v = static_cast<double>(row);
            const std::array<BoxSlabs::Slab, 3> slabs = slabs_.along(v);
            for (int column = first_column_; column <= last_column_; ++column) {
                const double z = window_.at(column, row);
                if (!is_more(z - lowest)) continue;
                const auto u = static_cast<double>(column);
                const double low = BoxSlabs::low(slabs, u);
                if (!is_more(z - low) || low > BoxSlabs::high(slabs, u)) continue;
                if (!slabs_.is_between_sides(u, v)) continue;
                raise_to(z - low, u, v, std::min(column, window_.columns - 1),
                         std::min(row, window_.rows - 1));
            }
        }
    }

    void visit_corner(const WindowPoint& p) {
        if (!is_more(window_.high - p.z)) return;
        const int column = cell_of(p.x, window_.columns);
        const int row = cell_of(p.y, window_.rows);
        const double u = p.x - static_cast<double>(column);
        const double v = p.y - static_cast<double>(row);
        const double south_west = window_.at(column, row);
        const double south_east = window_.at(column + 1, row);
        const double north_west = window_.at(column, row + 1);
        const double north_east = window_.at(column + 1, row + 1);
        double height = 0.0;
        if (window_.is_cut_to_north_east(column, row)) {
            height = south_west +
                     (u >= v ? (south_east - south_west) * u + (north_east - south_east) * v
                             : (north_east - north_west) * u + (north_west - south_west) * v);
        } else if (u + v <= 1.0) {
            height = south_west + ((south_east - south_west) * u + (north_west - south_west) * v);
        } else {
            height = north_east + ((north_west - north_east) * (1.0 - u) +
                                   (south_east - north_east) * (1.0 - v));
        }
        raise_to(height - p.z, p.x, p.y, column, row);
    }

    void visit_edges() {
        for (int i = 0; i < 3; ++i) {
            // bit j is set in the indices of corners on the upper face of axis j; -1 if the axis is horizontal
            const auto up_of = [&](int j) {
                const double z = box_.axes[static_cast<std::size_t>(j)][2];
                return z > 0.0 ? 1 << j : (z < 0.0 ? 0 : -1);
            };
            const int j0 = (i + 1) % 3;
            const int j1 = (i + 2) % 3;
            const int up0 = up_of(j0);
            const int up1 = up_of(j1);
            for (int k = 0; k < 8; ++k) {
                if ((k >> i & 1) != 0) continue;
                // An edge between two upward faces is not on the underside.
                if ((k & 1 << j0) == up0 && (k & 1 << j1) == up1) continue;
                const WindowPoint& from = corners_[static_cast<std::size_t>(k)];
                const WindowPoint& to = corners_[static_cast<std::size_t>(k | 1 << i)];
                visit_low_part(from, to);
            }
        }
    }

    // Tests only the part of an edge that is low enough to exceed the best lift so far.
    void visit_low_part(WindowPoint from, WindowPoint to) {
        if (from.z > to.z) std::swap(from, to);
        const double rise = window_.high - limit_ - from.z;
        if (!(rise > 0.0)) return;
        const double whole = to.z - from.z;
        if (rise < whole) {
            const double share = rise / whole;
            to = {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y),
                  from.z + rise};
        }
        visit_edge(from, to);
    }

    void visit_edge(const WindowPoint& from, const WindowPoint& to) {
        const double dx = to.x - from.x;
        const double dy = to.y - from.y;
        const double dz = to.z - from.z;
        cross_lines(from.x, to.x, 1, 0, [&](int line, double t) {
            if (line < 0 || line > window_.columns) return;
            const double y = from.y + t * dy;
            const int row = cell_of(y, window_.rows);
            const double a = window_.at(line, row);
            const double height =
                a + (y - static_cast<double>(row)) * (window_.at(line, row + 1) - a);
            raise_to(height - (from.z + t * dz), static_cast<double>(line), y,
                     std::min(line, window_.columns - 1), row);
        });
        cross_lines(from.y, to.y, 1, 0, [&](int line, double t) {
            if (line < 0 || line > window_.rows) return;
            const double x = from.x + t * dx;
            const int column = cell_of(x, window_.columns);
            const double a = window_.at(column, line);
            const double height =
                a + (x - static_cast<double>(column)) * (window_.at(column + 1, line) - a);
            raise_to(height - (from.z + t * dz), x, static_cast<double>(line), column,
                     std::min(line, window_.rows - 1));
        });
        const int odd = window_.is_odd ? 1 : 0;
        cross_lines(from.x - from.y, to.x - to.y, 2, odd, [&](int line, double t) {
            const double x = from.x + t * dx;
            const int column = cell_of(x, window_.columns);
            const int row = column - line;
            if (row < 0 || row >= window_.rows) return;
            const double u = x - static_cast<double>(column);
            const double a = window_.at(column, row);
            const double height = a + u * (window_.at(column + 1, row + 1) - a);
            raise_to(height - (from.z + t * dz), x, static_cast<double>(row) + u, column, row);
        });
        cross_lines(from.x + from.y, to.x + to.y, 2, odd, [&](int line, double t) {
            const double x = from.x + t * dx;
            const int column = cell_of(x, window_.columns);
            const int row = line - column - 1;
            if (row < 0 || row >= window_.rows) return;
            const double u = x - static_cast<double>(column);
            const double a = window_.at(column, row + 1);
            const double height = a + u * (window_.at(column + 1, row) - a);
            raise_to(height - (from.z + t * dz), x, static_cast<double>(row + 1) - u, column, row);
        });
    }

    // Calls cross(line, t) for the integers between a and b that equal `odd` modulo `step`.
    template <class Cross>
    static void cross_lines(double a, double b, int step, int odd, Cross cross) {
        const double low = std::min(a, b);
        const double high = std::max(a, b);
        auto line = static_cast<int>(low);
        if (static_cast<double>(line) < low) ++line;
        if (step == 2 && ((line & 1) != odd)) ++line;
        if (static_cast<double>(line) > high) return;
        // An edge parallel to the lines of this family crosses none of them; other families cover the edge's ends.
        if (!(high - low > 1e-300)) return;
        const double share = 1.0 / (b - a);
        for (; static_cast<double>(line) <= high; line += step) {
            cross(line, std::clamp((static_cast<double>(line) - a) * share, 0.0, 1.0));
        }
    }

    static int cell_of(double p, int count) {
        return std::clamp(static_cast<int>(p), 0, count - 1);
    }

    const LocalWindow& window_;
    const LocalShape& box_;
    double limit_;   // lifts up to it are ignored
    double enough_;  // the search stops at a lift above this
    std::array<WindowPoint, 8> corners_;
    BoxSlabs slabs_;
    int first_column_ = 0, last_column_ = 0, first_row_ = 0, last_row_ = 0;
    WindowLift best_;
    double x_ = 0.0, y_ = 0.0;  // position of the best lift, cells
};

}  // namespace

WindowLift find_box_lift(const LocalWindow& window, const Eigen::Vector3d& corner, double spacing,
                         const LocalShape& box, double floor, double enough) {
    return BoxScan(window, corner, spacing, box, floor, enough).run();
}

// Lift of a sphere or capsule. Its lift over the plane of a face is a cheap upper bound of its lift over the face. The
// rims of faces whose bounds exceed the best lift are tested last.

namespace {

class RoundScan {
public:
    RoundScan(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
              const LocalShape& shape, double floor, double enough)
        : local_(local),
          window_(window),
          shape_(shape),
          floor_(floor),
          enough_(enough),
          spacing_(local.spacing()),
          per_metre_(local.inverse_spacing()),
          lowest_(shape.centre[2] - shape.bounds[2]),
          cells_(window, cells) {}

    WindowLift run() {
        // Starts with the cell under the lowest point: its lift is usually large and excludes most other cells.
        const Eigen::Vector3d p =
            shape_.deepest_point(Eigen::Vector3d::UnitZ()) - local_.corner(window_);
        const int first_column =
            std::clamp(static_cast<int>(p[0] / spacing_), cells_.west, cells_.east);
        const int first_row =
            std::clamp(static_cast<int>(p[1] / spacing_), cells_.south, cells_.north);
        visit_cell(first_column, first_row);
        for (int row = cells_.south; row <= cells_.north && best_.lift <= enough_; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                if (column != first_column || row != first_row) visit_cell(column, row);
            }
        }
        for (std::size_t i = 0; i < open_count_; ++i) {
            const OpenFace& open = open_[i];
            if (!is_more(open.bound) || best_.lift > enough_) continue;
            raise_to(
                lift_over_rim(shape_, local_.corners(window_, open.column, open.row, open.is_south),
                              {open.most_x, open.most_y, 0.0}),
                open.column, open.row, open.is_south);
        }
        return best_;
    }

private:
    // A face that does not contain the point of largest lift over its plane.
    struct OpenFace {
        double bound;
        double most_x, most_y;  // that point
        int column, row;
        bool is_south;
    };

    bool is_more(double lift) const { return lift > std::max(floor_, best_.lift); }

    void raise_to(double lift, int column, int row, bool is_south) {
        if (is_more(lift)) best_ = {lift, column, row, is_south};
    }

    void visit_cell(int column, int row) {
        if (!is_more(window_.highest(column, row) - lowest_)) return;
        const bool is_even = window_.is_cut_to_north_east(column, row);
        const double west = local_.x(window_.cells.west + column);
        const double south = local_.y(window_.cells.south + row);
        // relative to the southern end of the cell's diagonal
        const double start_x = is_even ? west : west + spacing_;
        const double start_z = window_.at(is_even ? column : column + 1, row);
        for (const bool is_south : {true, false}) {
            const WindowSlopes slopes = window_.slopes(column, row, is_south);
            const double x = slopes.x * per_metre_;
            const double y = slopes.y * per_metre_;
            const double up = std::sqrt(1.0 + x * x + y * y);
            const double along = x * shape_.core[0] + y * shape_.core[1] - shape_.core[2];
            // the end of the core with the larger lift over the plane
            const double sign = along < 0.0 ? -1.0 : 1.0;
            const Eigen::Vector3d end(shape_.centre[0] + sign * shape_.core[0] - start_x,
                                      shape_.centre[1] + sign * shape_.core[1] - south,
                                      shape_.centre[2] + sign * shape_.core[2] - start_z);
            const double bound = x * end[0] + y * end[1] - end[2] + shape_.radius * up;
            if (!is_more(bound)) continue;
            const double reach = shape_.radius / up;
            const double most_x = end[0] + reach * x;
            const double most_y = end[1] + reach * y;
            if (is_over(is_even, is_south, is_even ? most_x : most_x + spacing_, most_y)) {
                raise_to(bound, column, row, is_south);
            } else {
                open_[open_count_++] = {bound, start_x + most_x, south + most_y, column,
                                        row,   is_south};
            }
        }
    }

    // Whether a point, relative to a cell's south-western corner, lies on the cell's southern or northern triangle.
    bool is_over(bool is_even, bool is_south, double u, double v) const {
        if (u < 0.0 || u > spacing_ || v < 0.0 || v > spacing_) return false;
        const double north = is_even ? v - u : (u + v) - spacing_;
        return is_south ? north <= 0.0 : north >= 0.0;
    }

    const LocalGround& local_;
    const LocalWindow& window_;
    const LocalShape& shape_;
    double floor_;
    double enough_;
    double spacing_;
    double per_metre_;  // cells per metre
    double lowest_;
    WindowCells cells_;
    std::array<OpenFace, 2 * LocalWindow::kMostCells * LocalWindow::kMostCells> open_;
    std::size_t open_count_ = 0;
    WindowLift best_;
};

}  // namespace

WindowLift find_round_lift(const LocalGround& local, const LocalWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough) {
    return RoundScan(local, window, cells, shape, floor, enough).run();
}

}  // namespace terrane::internal
