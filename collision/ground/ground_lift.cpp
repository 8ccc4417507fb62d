// SPDX-License-Identifier: MIT
#include "ground_lift.h"

#include "box_lift.h"
#include "round_lift.h"
#include "underside.h"

namespace terrane::internal {
namespace {

struct LiftVisitor {
    const LocalGround& local;
    const LocalShape& shape;
    const Underside& underside;
    double floor;
    double enough;
    GroundLift result;

    bool wants(const Prism& prism) const {
        if (result.lift > enough) return false;
        const Eigen::Vector3d& c = shape.centre;
        if (prism.west > c[0] + shape.bounds[0] || prism.east < c[0] - shape.bounds[0] ||
            prism.south > c[1] + shape.bounds[1] || prism.north < c[1] - shape.bounds[1]) {
            return false;
        }
        const double best = std::max(floor, result.lift);
        if (prism.high - (c[2] - shape.bounds[2]) <= best) return false;
        // A hair lower, for what rounding does to the bound.
        const double hair = 1e-12 * (1.0 + std::abs(prism.high) + std::abs(c[2]));
        return underside.may_reach(prism, prism.high - std::max(best, -1e300) + hair);
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result.error_m = std::max(result.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) take(triangle);
    }
    void take(const Triangle& triangle) {
        const double best = std::max(floor, result.lift);
        if (!(bound_column_lift(shape, triangle) > best)) return;
        const double lift = compute_column_lift(shape, triangle, best);
        if (lift > result.lift) {
            result.lift = lift;
            result.triangle = triangle;
        }
    }
    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        result.is_missing = true;
        return false;
    }
};

// Over a window that holds the cells under a shape and one more on each side.
GroundLift find_lift(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                     const LocalShape& shape, double floor) {
    GroundLift result;
    const WindowLift found =
        shape.kind == ShapeKind::box
            ? find_box_lift(window, local.corner(window), local.spacing(), shape, floor)
            : find_round_lift(local, window, cells, shape, floor);
    if (!(found.lift > floor)) return result;
    result.lift = found.lift;
    result.triangle = local.triangle(window, found.column, found.row, found.is_south);
    return result;
}

// Of a shape over the cells of a range that a window holds.
void visit_window(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                  LiftVisitor& visitor) {
    const auto west = static_cast<int>(cells.west - window.cells.west);
    const auto south = static_cast<int>(cells.south - window.cells.south);
    const int columns = static_cast<int>(cells.east - cells.west) + 1;
    const int rows = static_cast<int>(cells.north - cells.south) + 1;
    const auto take = [&](int column, int row) {
        const double high = window.highest(column, row);
        const std::int64_t x = window.cells.west + column;
        const std::int64_t y = window.cells.south + row;
        if (!visitor.wants({local.x(x), local.y(y), local.x(x + 1), local.y(y + 1), high})) return;
        visitor.take(local.triangle(window, column, row, true));
        visitor.take(local.triangle(window, column, row, false));
    };
    // The cell under the lowest point first: most others need only be bounded after it.
    const Eigen::Vector3d lowest =
        visitor.shape.deepest_point(Eigen::Vector3d::UnitZ()) - local.corner(window);
    const int first_column =
        std::clamp(static_cast<int>(lowest[0] / local.spacing()), west, west + columns - 1);
    const int first_row =
        std::clamp(static_cast<int>(lowest[1] / local.spacing()), south, south + rows - 1);
    take(first_column, first_row);
    for (int row = south; row < south + rows; ++row) {
        for (int column = west; column < west + columns; ++column) {
            if (column != first_column || row != first_row) take(column, row);
        }
    }
}

}  // namespace

GroundLift find_lift(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& d,
                     double floor, double enough, LiftError error) {
    LocalShape moved = shape;
    moved.centre += d;
    const Eigen::Vector3d low = moved.centre - moved.bounds;
    const Eigen::Vector3d high = moved.centre + moved.bounds;
    const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
    const GroundWindow* const window = local.window(cells, 0);
    if (window != nullptr && moved.kind != ShapeKind::hull) {
        GroundLift lift = find_lift(local, *window, cells, moved, floor);
        if (error == LiftError::asked_for) lift.error_m = local.error(cells);
        return lift;
    }
    const Underside underside(moved);
    LiftVisitor visitor{local, moved, underside, floor, enough, {}};
    if (window != nullptr) {
        visit_window(local, *window, cells, visitor);
        if (error == LiftError::asked_for) visitor.result.error_m = local.error(cells);
        return visitor.result;
    }
    // The cell under the lowest point first: most others need only be bounded after it.
    const Eigen::Vector3d lowest = moved.deepest_point(Eigen::Vector3d::UnitZ());
    const CellRange first = local.cells(lowest[0], lowest[1], lowest[0], lowest[1]);
    if (first.west <= first.east && first.south <= first.north) {
        const GroundCell cell = local.cell(first.east, first.north);
        if (cell.status == GroundStatus::ok) visitor.take(cell, first.east, first.north);
        if (visitor.result.lift > enough) return visitor.result;
    }
    visit_cells(local, cells, visitor);
    return visitor.result;
}

GroundLift find_lift(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& d,
                     double floor, double enough, LiftError error) {
    if (!body.is_compound()) return find_lift(local, body.whole(), d, floor, enough, error);
    GroundLift all;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            if (all.lift > enough || all.is_missing) return false;
            const double bottom = centre[2] + d[2] - bounds[2];
            // A hair below, for what rounding does to the bound.
            const double hair = 1e-12 * (1.0 + std::abs(bottom));
            return bound_ground(local, centre + d, bounds) + hair >
                   bottom + std::max(floor, all.lift);
        },
        [&](const LocalShape& shape, std::uint32_t part) {
            const GroundLift lift =
                find_lift(local, shape, d, std::max(floor, all.lift), enough, error);
            all.error_m = std::max(all.error_m, lift.error_m);
            all.is_missing = all.is_missing || lift.is_missing;
            if (!(lift.lift > all.lift)) return;
            all.lift = lift.lift;
            all.triangle = lift.triangle;
            all.part = part;
        });
    return all;
}

double bound_ground(const LocalGround& local, const Eigen::Vector3d& centre,
                    const Eigen::Vector3d& bounds) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr std::int64_t kMost = 64;  // cells along a side
    const Eigen::Vector3d low = centre - bounds;
    const Eigen::Vector3d high = centre + bounds;
    const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return -kInfinity;
    if (cells.east - cells.west > kMost || cells.north - cells.south > kMost) return kInfinity;
    const RangeAnswer range = local.ground().range(cells);
    if (range.status == GroundStatus::outside) return -kInfinity;
    if (range.high == std::numeric_limits<std::int32_t>::max()) return kInfinity;
    return local.z(range.high);
}

}  // namespace terrane::internal
