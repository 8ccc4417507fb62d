// SPDX-License-Identifier: MIT
//
// The lift over a face is bounded by that over its plane, which is cheap; the rims of faces whose bounds exceed the
// best lift come last.
#include "ground/lift/round_lift.h"

#include "ground/column/round_column.h"
#include "ground/frame/window_features.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

class RoundScan {
public:
    RoundScan(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
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
        // The cell under the lowest point first, so that bounds exclude most others.
        const Eigen::Vector3d p =
            shape_.deepest_point(Eigen::Vector3d::UnitZ()) - local_.corner(window_);
        const int first_column =
            std::clamp(static_cast<int>(p[0] / spacing_), cells_.west, cells_.east);
        const int first_row =
            std::clamp(static_cast<int>(p[1] / spacing_), cells_.south, cells_.north);
        take_cell(first_column, first_row);
        for (int row = cells_.south; row <= cells_.north && best_.lift <= enough_; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                if (column != first_column || row != first_row) take_cell(column, row);
            }
        }
        for (std::size_t i = 0; i < open_count_; ++i) {
            const OpenFace& open = open_[i];
            if (!is_more(open.bound) || best_.lift > enough_) continue;
            take(
                lift_over_rim(shape_, local_.corners(window_, open.column, open.row, open.is_south),
                              {open.most_x, open.most_y, 0.0}),
                open.column, open.row, open.is_south);
        }
        return best_;
    }

private:
    // A face beside the point where the lift over its plane is largest.
    struct OpenFace {
        double bound;
        double most_x, most_y;  // that point
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
                take(bound, column, row, is_south);
            } else {
                open_[open_count_++] = {bound, start_x + most_x, south + most_y, column,
                                        row,   is_south};
            }
        }
    }

    // Whether a point, relative to the south-western corner of a cell, lies on one of its triangles.
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
    double per_metre_;  // cells per metre
    double lowest_;
    WindowCells cells_;
    std::array<OpenFace, 2 * GroundWindow::kMostCells * GroundWindow::kMostCells> open_;
    std::size_t open_count_ = 0;
    WindowLift best_;
};

}  // namespace

WindowLift find_round_lift(const LocalGround& local, const GroundWindow& window,
                           const CellRange& cells, const LocalShape& shape, double floor,
                           double enough) {
    return RoundScan(local, window, cells, shape, floor, enough).run();
}

}  // namespace terrane::internal
