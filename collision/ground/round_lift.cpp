// SPDX-License-Identifier: MIT
//
// The height of the ground over a sphere or capsule is most where its lowest point over a face is square to
// the face, or else on the rim of the face: over an edge, where the shape's section is a disc that moves, or
// over a corner. The plane of a face alone bounds all of these.
#include "round_lift.h"

#include "triangle_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Where s in [-1, 1] maximises linear * s + reach * sqrt(square - (offset + rate * s)^2), among the s
// where the root exists. False where there is none.
bool find_round_maximum(double linear, double reach, double square, double offset, double rate,
                        double& s_out) {
    if (square < 0.0) return false;
    double first = -1.0;
    double last = 1.0;
    if (rate == 0.0) {
        if (offset * offset > square) return false;
        s_out = linear > 0.0 ? 1.0 : (linear < 0.0 ? -1.0 : 0.0);
        return true;
    }
    const double root = std::sqrt(square);
    first = std::max(first, std::min((-root - offset) / rate, (root - offset) / rate));
    last = std::min(last, std::max((-root - offset) / rate, (root - offset) / rate));
    if (first > last) return false;
    // With d = offset + rate s the maximum of (linear / rate) d + reach sqrt(square - d^2).
    const double along = linear / rate;
    const double size = std::sqrt(along * along + reach * reach);
    const double d = size > 0.0 ? root * (along / size) : 0.0;
    s_out = std::clamp((d - offset) / rate, first, last);
    return true;
}

// Over the vertical wall through an edge that starts at `a`. Where that is most beyond an end of the edge, over
// that end alone: `end_out` is -1 or 1, else 0.
double lift_over_edge(const LocalShape& shape, const Eigen::Vector3d& a,
                      const Eigen::Vector3d& edge, int& end_out) {
    const double run = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
    const Eigen::Vector3d along(edge[0] / run, edge[1] / run, 0.0);
    const Eigen::Vector3d out(along[1], -along[0], 0.0);
    const Eigen::Vector3d from = shape.centre - a;
    // The section with the wall: discs whose centres move with s.
    const double grade = edge[2] / run;
    const double distance = dot(out, from);
    const double rate = dot(out, shape.core);
    const double rise = grade * dot(along, shape.core) - shape.core[2];
    const double reach = std::sqrt(grade * grade + 1.0);
    const double square = shape.radius * shape.radius;
    double s = 0.0;
    end_out = 0;
    if (!find_round_maximum(rise, reach, square, distance, rate, s)) return -kInfinity;
    const double d = distance + rate * s;
    const double r = std::sqrt(std::max(0.0, square - d * d));
    const double u = dot(along, from) + s * dot(along, shape.core) + r * grade / reach;
    if (u < 0.0) end_out = -1;
    if (u > run) end_out = 1;
    return grade * u - (from[2] + s * shape.core[2] - r / reach);
}

// On the vertical through a point.
double lift_over_corner(const LocalShape& shape, const Eigen::Vector3d& corner) {
    const Eigen::Vector3d from = shape.centre - corner;
    const double square = shape.radius * shape.radius;
    const double core_run =
        std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    double across = 0.0;
    double offset = 0.0;
    if (core_run > 0.0) {
        across = (from[0] * shape.core[1] - from[1] * shape.core[0]) / core_run;
        offset = (from[0] * shape.core[0] + from[1] * shape.core[1]) / core_run;
    } else {
        across = std::sqrt(from[0] * from[0] + from[1] * from[1]);
    }
    double s = 0.0;
    if (!find_round_maximum(-shape.core[2], 1.0, square - across * across, offset, core_run, s)) {
        return -kInfinity;
    }
    const double d = offset + core_run * s;
    const double r = std::sqrt(std::max(0.0, square - across * across - d * d));
    return -(from[2] + s * shape.core[2] - r);
}

// Over the rim of a triangle whose plane lifts the shape most at a point beside it. How much the plane lifts is
// concave: over the triangle it is most on an edge that parts it from the point, and there nearest to the
// edge's own most.
double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most) {
    double lift = -kInfinity;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& a = corners[i];
        const Eigen::Vector3d& b = corners[(i + 1) % 3];
        const Eigen::Vector3d edge = b - a;
        // A hair inside does not count: rounding may have put the point beside the triangle.
        const double hair = 1e-9 * (edge[0] * edge[0] + edge[1] * edge[1]);
        if (left_of(a, b, most) > hair) continue;
        int end = 0;
        const double over_edge = lift_over_edge(shape, a, edge, end);
        lift = std::max(lift, end == 0 ? over_edge : lift_over_corner(shape, end < 0 ? a : b));
    }
    return lift;
}

class Scan {
public:
    Scan(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
         const LocalShape& shape, double floor, double enough)
        : local_(local),
          window_(window),
          shape_(shape),
          floor_(floor),
          enough_(enough),
          spacing_(local.spacing()),
          per_metre_(local.inverse_spacing()),
          lowest_(shape.centre[2] - shape.bounds[2]),
          west_(static_cast<int>(cells.west - window.cells.west)),
          south_(static_cast<int>(cells.south - window.cells.south)),
          east_(static_cast<int>(cells.east - window.cells.west)),
          north_(static_cast<int>(cells.north - window.cells.south)) {}

    WindowLift run() {
        // The cell under the lowest point first: most others need only be bounded after it.
        const Eigen::Vector3d p =
            shape_.deepest_point(Eigen::Vector3d::UnitZ()) - local_.corner(window_);
        const int first_column = std::clamp(static_cast<int>(p[0] / spacing_), west_, east_);
        const int first_row = std::clamp(static_cast<int>(p[1] / spacing_), south_, north_);
        take_cell(first_column, first_row);
        for (int row = south_; row <= north_ && best_.lift <= enough_; ++row) {
            for (int column = west_; column <= east_; ++column) {
                if (column != first_column || row != first_row) take_cell(column, row);
            }
        }
        for (std::size_t i = 0; i < open_count_; ++i) {
            const Open& open = open_[i];
            if (!is_more(open.bound) || best_.lift > enough_) continue;
            take(
                lift_over_rim(shape_, local_.corners(window_, open.column, open.row, open.is_south),
                              {open.most_x, open.most_y, 0.0}),
                open.column, open.row, open.is_south);
        }
        return best_;
    }

private:
    // A face whose plane would lift the shape by more than itself does.
    struct Open {
        double bound;
        double most_x, most_y;  // where the plane does
        int column, row;
        bool is_south;
    };

    bool is_more(double lift) const { return lift > std::max(floor_, best_.lift); }

    void take(double lift, int column, int row, bool is_south) {
        if (is_more(lift)) best_ = {lift, column, row, is_south};
    }

    void take_cell(int column, int row) {
        if (!is_more(window_.highest(column, row) - lowest_)) return;
        const bool is_even = window_.is_cut_to_north_east(column, row);
        const double west = local_.x(window_.cells.west + column);
        const double south = local_.y(window_.cells.south + row);
        // seen from where the cell's cut starts in the south
        const double start_x = is_even ? west : west + spacing_;
        const double start_z = window_.at(is_even ? column : column + 1, row);
        for (const bool is_south : {true, false}) {
            const WindowSlopes slopes = window_.slopes(column, row, is_south);
            const double x = slopes.x * per_metre_;
            const double y = slopes.y * per_metre_;
            const double up = std::sqrt(1.0 + x * x + y * y);
            const double along = x * shape_.core[0] + y * shape_.core[1] - shape_.core[2];
            // the lowest point of the end that the plane lifts more
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
                take(bound, column, row, is_south);
            } else {
                open_[open_count_++] = {bound, start_x + most_x, south + most_y, column,
                                        row,   is_south};
            }
        }
    }

    // Whether a place, from the south-western corner of a cell, lies on one of its triangles.
    bool is_over(bool is_even, bool is_south, double u, double v) const {
        if (u < 0.0 || u > spacing_ || v < 0.0 || v > spacing_) return false;
        const double north = is_even ? v - u : (u + v) - spacing_;
        return is_south ? north <= 0.0 : north >= 0.0;
    }

    const LocalGround& local_;
    const GroundWindow& window_;
    const LocalShape& shape_;
    double floor_;
    double enough_;
    double spacing_;
    double per_metre_;  // cells
    double lowest_;
    int west_, south_, east_, north_;
    std::array<Open, 2 * GroundWindow::kMostCells * GroundWindow::kMostCells> open_;
    std::size_t open_count_ = 0;
    WindowLift best_;
};

}  // namespace

double compute_round_lift(const LocalShape& shape, const Triangle& triangle) {
    const TrianglePlane plane(triangle);
    double lift = -kInfinity;
    double highest = -kInfinity;
    Eigen::Vector3d most = shape.centre;
    for (const double s : {-1.0, 1.0}) {
        const Eigen::Vector3d lowest =
            shape.centre + s * shape.core - shape.radius * triangle.normal;
        const double above = plane.above(lowest);
        if (above > highest) {
            highest = above;
            most = lowest;
        }
        if (above > lift && is_over(lowest, triangle)) lift = above;
    }
    return lift < highest ? std::max(lift, lift_over_rim(shape, triangle.v, most)) : lift;
}

WindowLift find_round_lift(const LocalGround& local, const GroundWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough) {
    return Scan(local, window, cells, shape, floor, enough).run();
}

}  // namespace terrane::internal
