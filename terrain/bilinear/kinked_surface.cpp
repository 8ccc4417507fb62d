// SPDX-License-Identifier: MIT
//
// Exact deviations of a bilinear surface from planes.
//
// Surface minus plane is bilinear in each raster cell. So over a rectangle its extremes are at the corners, and along a
// line between raster cells or a leg of a triangle it is linear from one crossing to the next. Over a triangle its
// extremes are therefore at a sample inside, at a crossing of a leg and a line, at a corner, or on the hypotenuse,
// where it is a parabola from one crossing to the next. All of these are visited: apart from rounding, the bound is the
// greatest deviation itself.
#include "bilinear/kinked_surface.h"

#include <bit>
#include <cmath>
#include <utility>

namespace terrane::internal {

template <typename PlaceOf>
KinkedSurface::Axis KinkedSurface::make_axis(std::int64_t first, int points,
                                             std::int64_t first_line, int lines, double per_cell,
                                             PlaceOf&& place_of) {
    Axis axis;
    axis.first = first;
    axis.per_cell = per_cell;
    axis.lines.reserve(static_cast<std::size_t>(lines));
    for (int i = 0; i < lines; ++i) axis.lines.push_back(place_of(first_line + i));
    axis.at_or_after.reserve(static_cast<std::size_t>(points));
    axis.after.reserve(static_cast<std::size_t>(points));
    std::size_t line = 0;
    for (int i = 0; i < points; ++i) {
        while (line < axis.lines.size() && axis.lines[line] < axis.point(i)) ++line;
        axis.at_or_after.push_back(static_cast<int>(line));
        const bool is_on = line < axis.lines.size() && axis.lines[line] == axis.point(i);
        axis.after.push_back(static_cast<int>(line) + (is_on ? 1 : 0));
    }
    return axis;
}

KinkedSurface::KinkedSurface(const BilinearGrid& grid, const SampleGrid& points, RasterPatch patch)
    : patch_(std::move(patch)) {
    const double step = grid.lattice.spacing * static_cast<double>(points.step);
    x_ = make_axis(
        points.corner.x / points.step, points.columns, patch_.column, patch_.columns,
        step / grid.cell_x, [&](std::int64_t column) {
            return (grid.west + static_cast<double>(column) * grid.cell_x - grid.lattice.origin_x) /
                   step;
        });
    y_ = make_axis(
        points.corner.y / points.step, points.rows, patch_.row, patch_.rows, step / grid.cell_y,
        [&](std::int64_t row) {
            return (grid.south + static_cast<double>(row) * grid.cell_y - grid.lattice.origin_y) /
                   step;
        });
    on_rows_.reserve(static_cast<std::size_t>(points.rows) * x_.lines.size());
    for (int y = 0; y < points.rows; ++y) {
        const int r = y_.after[static_cast<std::size_t>(y)] - 1;
        const double part = (y_.point(y) - y_.lines[static_cast<std::size_t>(r)]) * y_.per_cell;
        for (int c = 0; c < patch_.columns; ++c) {
            const double south = sample(c, r);
            on_rows_.push_back(south + part * (sample(c, r + 1) - south));
        }
    }
    on_columns_.reserve(static_cast<std::size_t>(points.columns) * y_.lines.size());
    for (int x = 0; x < points.columns; ++x) {
        const int c = x_.after[static_cast<std::size_t>(x)] - 1;
        const double part = (x_.point(x) - x_.lines[static_cast<std::size_t>(c)]) * x_.per_cell;
        for (int r = 0; r < patch_.rows; ++r) {
            const double west = sample(c, r);
            on_columns_.push_back(west + part * (sample(c + 1, r) - west));
        }
    }
    heights_.reserve(points.size());
    for (int y = 0; y < points.rows; ++y) {
        for (int x = 0; x < points.columns; ++x) {
            heights_.push_back(height(x_.after[static_cast<std::size_t>(x)] - 1,
                                      y_.after[static_cast<std::size_t>(y)] - 1, x_.point(x),
                                      y_.point(y)));
        }
    }
}

void KinkedSurface::keep_diagonals(int n) {
    if (std::countr_zero(static_cast<unsigned>(n)) < static_cast<int>(diagonals_.size())) return;
    const int columns = static_cast<int>(x_.after.size()), rows = static_cast<int>(y_.after.size());
    const auto to_multiple = [n](std::int64_t first) {
        return static_cast<int>(-first & (std::int64_t{n} - 1));
    };
    Diagonals kept;
    kept.x = to_multiple(x_.first);
    kept.y = to_multiple(y_.first);
    kept.columns = std::max(0, (columns - 1 - kept.x) / n);
    const int count = std::max(0, (rows - 1 - kept.y) / n);
    kept.ranges.reserve(static_cast<std::size_t>(kept.columns) * static_cast<std::size_t>(count));
    for (int row = 0; row < count; ++row) {
        for (int column = 0; column < kept.columns; ++column) {
            const int x = kept.x + column * n, y = kept.y + row * n;
            const bool north = (((x_.first + x) / n + (y_.first + y) / n) & 1) == 0;
            const int begin_y = north ? y : y + n, end_y = north ? y + n : y;
            kept.ranges.push_back(diagonal(x, begin_y, n, north, point_height(x, begin_y),
                                           point_height(x + n, end_y)));
        }
    }
    diagonals_.push_back(std::move(kept));
}

Range KinkedSurface::diagonal(int x, int y, int n, bool north, double begin_height,
                              double end_height) const {
    const double x0 = x_.point(x), y0 = y_.point(y);
    int c = x_.after[static_cast<std::size_t>(x)] - 1;
    int r = (north ? y_.after : y_.at_or_after)[static_cast<std::size_t>(y)] - 1;
    const double end = n;
    const double slope = (end_height - begin_height) / end;
    const double last_difference = point_height(x + n, north ? y + n : y - n) - end_height;
    double t = 0.0, difference = point_height(x, y) - begin_height;
    Range range{difference, difference};
    while (t < end) {
        const double to_x = x_.lines[static_cast<std::size_t>(c) + 1] - x0;
        const double to_y = north ? y_.lines[static_cast<std::size_t>(r) + 1] - y0
                                  : y0 - y_.lines[static_cast<std::size_t>(r)];
        const double next = std::min(end, std::min(to_x, to_y));
        const double next_y = north ? y0 + next : y0 - next;
        const double next_difference =
            next < end ? height(c, r, x0 + next, next_y) - (begin_height + slope * next)
                       : last_difference;
        range.add(next_difference);
        // Four times the height of the parabola above the middle of its chord.
        const double length = next - t;
        const double twist =
            sample(c, r) - sample(c + 1, r) - sample(c, r + 1) + sample(c + 1, r + 1);
        const double bow =
            (north ? -twist : twist) * (length * x_.per_cell) * (length * y_.per_cell);
        const double rise = next_difference - difference;
        if (std::fabs(rise) < std::fabs(bow)) {
            range.add(0.5 * (difference + next_difference) + 0.25 * bow +
                      rise * rise / (4.0 * bow));
        }
        difference = next_difference;
        t = next;
        if (to_x <= next) ++c;
        if (to_y <= next) r += north ? 1 : -1;
    }
    return range;
}

void KinkedSurface::add_triangle(const RightTriangle& t, Range& range) const {
    const bool east = t.sign_x > 0, north = t.sign_y > 0;
    const int x_end = t.x + t.sign_x * t.leg, y_end = t.y + t.sign_y * t.leg;
    const int west = std::min(t.x, x_end);
    const auto side_log2 = static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(t.leg)));
    if (side_log2 < diagonals_.size()) {
        const Diagonals& kept = diagonals_[side_log2];
        const int column = (west - kept.x) >> side_log2;
        const int row = (std::min(t.y, y_end) - kept.y) >> side_log2;
        range.add(kept.ranges[static_cast<std::size_t>(row * kept.columns + column)]);
    } else {
        const int begin_y = east ? y_end : t.y, end_y = east ? t.y : y_end;
        range.add(diagonal(west, begin_y, t.leg, east != north, point_height(west, begin_y),
                           point_height(west + t.leg, end_y)));
    }
    add_legs_and_inside(t, range);
}

void KinkedSurface::add_part(const RightTriangle& t, Range& range) const {
    const bool east = t.sign_x > 0, north = t.sign_y > 0;
    const int west = east ? t.x : t.x - t.leg;
    range.add(diagonal(west, east ? t.y + t.sign_y * t.leg : t.y, t.leg, east != north,
                       east ? t.at_y_end : t.at_x_end, east ? t.at_x_end : t.at_y_end));
    add_legs_and_inside(t, range);
}

void KinkedSurface::add_legs_and_inside(const RightTriangle& t, Range& range) const {
    const bool east = t.sign_x > 0, north = t.sign_y > 0;
    const int x_end = t.x + t.sign_x * t.leg, y_end = t.y + t.sign_y * t.leg;
    range.add(point_height(t.x, t.y) - t.at_corner);

    // The plane relative to the corner, in steps.
    const double x0 = x_.point(t.x), y0 = y_.point(t.y);
    const double slope_x = t.sign_x * ((t.at_x_end - t.at_corner) / t.leg);
    const double slope_y = t.sign_y * ((t.at_y_end - t.at_corner) / t.leg);
    const auto west_point = static_cast<std::size_t>(std::min(t.x, x_end));
    const auto east_point = static_cast<std::size_t>(std::max(t.x, x_end));
    const auto south_point = static_cast<std::size_t>(std::min(t.y, y_end));
    const auto north_point = static_cast<std::size_t>(std::max(t.y, y_end));
    int c_begin = x_.after[west_point], c_end = x_.at_or_after[east_point];
    const int r_begin = y_.after[south_point], r_end = y_.at_or_after[north_point];
    for (int c = c_begin; c < c_end; ++c) {
        const double along = x_.lines[static_cast<std::size_t>(c)] - x0;
        range.add(on_row(t.y, c) - (t.at_corner + along * slope_x));
    }
    for (int i = 0; i < r_end - r_begin; ++i) {
        // Rows are visited away from the corner and get shorter.
        const int r = north ? r_begin + i : r_end - 1 - i;
        const double up = y_.lines[static_cast<std::size_t>(r)] - y0;
        const double base = t.at_corner + up * slope_y;
        range.add(on_column(t.x, r) - base);
        const double length = t.leg - std::fabs(up);
        while (c_end > c_begin && east &&
               x_.lines[static_cast<std::size_t>(c_end) - 1] - x0 >= length) {
            --c_end;
        }
        while (c_end > c_begin && !east &&
               x0 - x_.lines[static_cast<std::size_t>(c_begin)] >= length) {
            ++c_begin;
        }
        for (int c = c_begin; c < c_end; ++c) {
            const double along = x_.lines[static_cast<std::size_t>(c)] - x0;
            range.add(sample(c, r) - (base + along * slope_x));
        }
    }
}

void KinkedSurface::add_square(int x, int y, int n, double at_corner, double at_x_end,
                               double at_y_end, Range& range) const {
    const auto at = [](int point) { return static_cast<std::size_t>(point); };
    const double x0 = x_.point(x), y0 = y_.point(y), end = n;
    const double slope_x = (at_x_end - at_corner) / end, slope_y = (at_y_end - at_corner) / end;
    const auto plane = [&](double along, double up) {
        return at_corner + (along * slope_x + up * slope_y);
    };
    const int c_begin = x_.after[at(x)], c_end = x_.at_or_after[at(x + n)];
    const int r_begin = y_.after[at(y)], r_end = y_.at_or_after[at(y + n)];
    for (const int i : {0, n}) {
        for (const int j : {0, n}) range.add(point_height(x + i, y + j) - plane(i, j));
    }
    for (int c = c_begin; c < c_end; ++c) {
        const double along = x_.lines[at(c)] - x0;
        range.add(on_row(y, c) - plane(along, 0.0));
        range.add(on_row(y + n, c) - plane(along, end));
    }
    for (int r = r_begin; r < r_end; ++r) {
        const double up = y_.lines[at(r)] - y0;
        range.add(on_column(x, r) - plane(0.0, up));
        range.add(on_column(x + n, r) - plane(end, up));
        for (int c = c_begin; c < c_end; ++c) {
            range.add(sample(c, r) - plane(x_.lines[at(c)] - x0, up));
        }
    }
}

Range KinkedSurface::bilinear_deviation(int x, int y, int n) const {
    const double south_west = point_height(x, y), south_east = point_height(x + n, y);
    const double north_west = point_height(x, y + n), north_east = point_height(x + n, y + n);
    const double x0 = x_.point(x), y0 = y_.point(y);
    Range range{0.0, 0.0};
    const auto add = [&](double height, double along, double up) {
        range.add(height -
                  bilinear(south_west, south_east, north_west, north_east, along / n, up / n));
    };
    const auto at = [](int point) { return static_cast<std::size_t>(point); };
    const int c_begin = x_.after[at(x)], c_end = x_.at_or_after[at(x + n)];
    const int r_begin = y_.after[at(y)], r_end = y_.at_or_after[at(y + n)];
    for (int c = c_begin; c < c_end; ++c) {
        const double along = x_.lines[at(c)] - x0;
        add(on_row(y, c), along, 0.0);
        add(on_row(y + n, c), along, n);
    }
    for (int r = r_begin; r < r_end; ++r) {
        const double up = y_.lines[at(r)] - y0;
        add(on_column(x, r), 0.0, up);
        add(on_column(x + n, r), n, up);
        for (int c = c_begin; c < c_end; ++c) add(sample(c, r), x_.lines[at(c)] - x0, up);
    }
    return range;
}

}  // namespace terrane::internal
