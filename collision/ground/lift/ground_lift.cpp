// SPDX-License-Identifier: MIT
#include "ground/lift/ground_lift.h"

#include "base/vector_math.h"
#include "ground/frame/solid_chunks.h"
#include "ground/frame/window_features.h"
#include "ground/lift/box_lift.h"
#include "ground/lift/box_slabs.h"
#include "ground/lift/round_lift.h"
#include "ground/lift/underside.h"

#include <optional>

namespace terrane::internal {
namespace {

class LiftVisitor {
public:
    LiftVisitor(const LocalGround& local, const LocalShape& shape, double floor, double enough)
        : local_(local), shape_(shape), underside_(shape), floor_(floor), enough_(enough) {
        if (shape.kind == ShapeKind::box) slabs_.emplace(shape, Eigen::Vector3d::Zero(), 1.0);
    }

    const GroundLift& result() const { return result_; }
    std::int64_t cells_tested() const { return cells_tested_; }

    bool wants(const CellPrism& prism) const {
        if (has_enough()) return false;
        const Eigen::Vector3d& c = shape_.centre;
        if (prism.west > c[0] + shape_.bounds[0] || prism.east < c[0] - shape_.bounds[0] ||
            prism.south > c[1] + shape_.bounds[1] || prism.north < c[1] - shape_.bounds[1]) {
            return false;
        }
        const double best = std::max(floor_, result_.lift);
        if (prism.high - (c[2] - shape_.bounds[2]) <= best) return false;
        // Slightly lower, for the rounding of the bound.
        const double slack = 1e-12 * (1.0 + std::abs(prism.high) + std::abs(c[2]));
        return underside_.may_reach(prism, prism.high - std::max(best, -1e300) + slack);
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result_.error_m = std::max(result_.error_m, static_cast<double>(cell.error_m));
        ++cells_tested_;
        if (slabs_ && take_corners(cell, column, row)) return;
        for (const Triangle& triangle : local_.triangles(cell, column, row)) take(triangle);
    }
    void take(const Triangle& triangle) {
        const double best = std::max(floor_, result_.lift);
        if (!(bound_column_lift(shape_, triangle) > best)) return;
        const double lift = compute_column_lift(shape_, triangle, best);
        if (lift > result_.lift) {
            result_.lift = lift;
            result_.triangle = triangle;
        }
    }
    bool miss(const CellPrism& prism) {
        if (!wants(prism)) return true;
        result_.is_missing = true;
        return false;
    }

    bool has_enough() const { return result_.lift > enough_; }

private:
    // Tests the corners of a cell against a box. True where that is exact for the whole cell, because one face of the
    // box is over all of it.
    bool take_corners(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        const std::array<std::int32_t, 4> heights{cell.south_west, cell.south_east, cell.north_west,
                                                  cell.north_east};
        double most = -kAnyLift;
        std::size_t which = 0;
        std::size_t faces = 0;
        bool is_over_all = true;
        for (std::size_t k = 0; k < 4; ++k) {
            const double x = local_.x(column + ((k & 1) != 0 ? 1 : 0));
            const double y = local_.y(row + ((k & 2) != 0 ? 1 : 0));
            const std::array<BoxSlabs::Slab, 3> slabs = slabs_->along(y);
            const double low = BoxSlabs::low(slabs, x);
            if (low > BoxSlabs::high(slabs, x) || !slabs_->is_between_sides(x, y)) {
                is_over_all = false;
                continue;
            }
            std::size_t face = 0;
            while (slabs[face].low + slabs[face].x * x < low) ++face;
            faces |= std::size_t{1} << face;
            const double lift = local_.z(heights[k]) - low;
            if (lift > most) {
                most = lift;
                which = k;
            }
        }
        if (most > std::max(floor_, result_.lift)) {
            result_.lift = most;
            // the first triangle has both southern corners
            result_.triangle = local_.triangles(cell, column, row)[which < 2 ? 0 : 1];
        }
        return is_over_all && (faces & (faces - 1)) == 0;
    }

    const LocalGround& local_;
    const LocalShape& shape_;
    Underside underside_;
    std::optional<BoxSlabs> slabs_;  ///< of a box
    double floor_;
    double enough_;
    std::int64_t cells_tested_ = 0;
    GroundLift result_;
};

// Lift of a box or a round shape over a window that holds the cells under it.
GroundLift find_lift(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                     const LocalShape& shape, double floor, double enough) {
    GroundLift result;
    const WindowLift found =
        shape.kind == ShapeKind::box
            ? find_box_lift(window, local.corner(window), local.spacing(), shape, floor, enough)
            : find_round_lift(local, window, cells, shape, floor, enough);
    if (!(found.lift > floor)) return result;
    result.lift = found.lift;
    result.triangle = local.triangle(window, found.column, found.row, found.is_south);
    return result;
}

// The first point of the line from a shape's lowest to its highest point that is over the ground that a range of cells
// is clamped to; the lowest point where none is.
Eigen::Vector3d find_point_over_ground(const LocalGround& local, const CellRange& cells,
                                       const LocalShape& shape, const Eigen::Vector3d& lowest) {
    // Two cells around the ground may be in the range.
    const double inside = 2.5 * local.spacing();
    const Eigen::Vector2d low(local.x(cells.west) + inside, local.y(cells.south) + inside);
    const Eigen::Vector2d high(local.x(cells.east + 1) - inside, local.y(cells.north + 1) - inside);
    const Eigen::Vector3d line = shape.deepest_point(-Eigen::Vector3d::UnitZ()) - lowest;
    double enter = 0.0;
    for (Eigen::Index i = 0; i < 2; ++i) {
        const double beyond =
            std::min(0.0, lowest[i] - low[i]) + std::max(0.0, lowest[i] - high[i]);
        if (beyond != 0.0 && -beyond / line[i] > enter) enter = -beyond / line[i];
    }
    return enter <= 1.0 ? Eigen::Vector3d(lowest + enter * line) : lowest;
}

// Visits the triangles of the cells of a range that a window holds.
void visit_window(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
                  const LocalShape& shape, LiftVisitor& visitor) {
    const WindowCells at(window, cells);
    const auto take = [&](int column, int row) {
        if (!visitor.wants(local.cell_prism(window, column, row))) return;
        visitor.take(local.triangle(window, column, row, true));
        visitor.take(local.triangle(window, column, row, false));
    };
    // The cell under the lowest point first, so that bounds exclude most others.
    const Eigen::Vector3d lowest =
        shape.deepest_point(Eigen::Vector3d::UnitZ()) - local.corner(window);
    const int first_column =
        std::clamp(static_cast<int>(lowest[0] / local.spacing()), at.west, at.east);
    const int first_row =
        std::clamp(static_cast<int>(lowest[1] / local.spacing()), at.south, at.north);
    take(first_column, first_row);
    for (int row = at.south; row <= at.north; ++row) {
        for (int column = at.west; column <= at.east; ++column) {
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
        GroundLift lift = find_lift(local, *window, cells, moved, floor, enough);
        if (error == LiftError::requested) lift.error_m = local.error(cells);
        return lift;
    }
    LiftVisitor visitor(local, moved, floor, enough);
    if (window != nullptr) {
        visit_window(local, *window, cells, moved, visitor);
        GroundLift lift = visitor.result();
        if (error == LiftError::requested) lift.error_m = local.error(cells);
        return lift;
    }
    // The cell under the lowest point and a few samples first, so that bounds exclude most others.
    const auto take_at = [&](double x, double y) {
        const CellRange at = local.cells(x, y, x, y);
        if (at.west > at.east || at.south > at.north) return;
        const GroundCell cell = local.cell(at.east, at.north);
        if (cell.status == GroundStatus::ok) visitor.take(cell, at.east, at.north);
    };
    const Eigen::Vector3d lowest = moved.deepest_point(Eigen::Vector3d::UnitZ());
    take_at(lowest[0], lowest[1]);
    if (visitor.cells_tested() == 0) {
        const Eigen::Vector3d over = find_point_over_ground(local, cells, moved, lowest);
        take_at(over[0], over[1]);
    }
    constexpr int kSamples = 8;  // along a side
    constexpr std::int64_t kMany = 4 * kSamples;
    if (cells.east - cells.west > kMany && cells.north - cells.south > kMany) {
        for (int i = 0; i < kSamples * kSamples && !visitor.has_enough(); ++i) {
            const int column = i % kSamples, row = i / kSamples;
            const double u = (column + 0.5) / kSamples;
            const double v = (row + 0.5) / kSamples;
            take_at(low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1]));
        }
    }
    if (!visitor.has_enough()) visit_cells(local, cells, visitor);
    local.add_cells_tested(visitor.cells_tested());
    return visitor.result();
}

GroundLift find_lift(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& d,
                     double floor, double enough, LiftError error) {
    if (!body.is_compound()) return find_lift(local, body.whole(), d, floor, enough, error);
    GroundLift all;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            if (all.lift > enough || all.is_missing) return false;
            const double bottom = centre[2] + d[2] - bounds[2];
            // Slightly higher, for the rounding of the bound.
            const double slack = 1e-12 * (1.0 + std::abs(bottom));
            return bound_ground(local, centre + d, bounds) + slack >
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
    constexpr std::int64_t kMost = 64;  // cells along a side
    const Eigen::Vector3d low = centre - bounds;
    const Eigen::Vector3d high = centre + bounds;
    const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return -kInfinity;
    if (cells.east - cells.west > kMost || cells.north - cells.south > kMost) return kInfinity;
    const RangeAnswer range = local.ground().range(cells);
    if (range.status == GroundStatus::outside) return -kInfinity;
    if (range.high == std::numeric_limits<std::int32_t>::max()) return kInfinity;
    const double field = local.z(range.high);
    if (!local.ground().has_solids()) return field;
    const Eigen::Vector3d origin = local.to_world(Eigen::Vector3d::Zero());
    constexpr double kHair = 1e-6;  // for rounding, metres
    const Eigen::Vector3d wider = Eigen::Vector3d::Constant(kHair);
    Aabb above{low + origin - wider, high + origin + wider};
    above.low.z() = field + origin.z();
    above.high.z() = kInfinity;
    return std::max(field, highest_solid(local.ground(), cells, above) - origin.z());
}

double highest_solid(const Ground& ground, const CellRange& cells, const Aabb& box_world) {
    double highest = -kInfinity;
    visit_solids(ground, cells, [&](const SolidSurface& solid, const CellRange&) {
        std::array<std::uint32_t, 1> found;
        std::uint32_t cursor = 0;
        if (solid.find_overlaps(box_world, cursor, found) == 0) return;
        highest = std::max(highest, solid.bounds().high.z());
    });
    return highest;
}

}  // namespace terrane::internal
