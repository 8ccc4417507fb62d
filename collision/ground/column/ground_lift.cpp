// SPDX-License-Identifier: MIT
#include "ground/column/ground_lift.h"

#include "base/vector_math.h"
#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"
#include "ground/column/window_features.h"
#include "ground/column/window_lift.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace terrane::internal {

/// Lower bounds of a shape's z over rectangles, from planes and strips that are computed once.
class Underside {
public:
    explicit Underside(const LocalShape& shape);

    /// Whether the shape may extend below `z` over the rectangle of a prism.
    bool may_reach(const CellPrism& prism, double z) const {
        if (shape_.kind != ShapeKind::round) {
            for (std::size_t i = 0; i < count_; ++i) {
                const Plane& plane = planes_[i];
                const double lowest = plane.z +
                                      std::min(plane.x * prism.west, plane.x * prism.east) +
                                      std::min(plane.y * prism.south, plane.y * prism.north);
                if (lowest >= z) return false;
            }
            return !is_beside(prism);
        }
        return round_bottom(prism) < z;
    }

private:
    struct Plane {
        double x, y, z;  // z = plane.z + plane.x * x + plane.y * y
    };

    void add_strip(const LocalHull::Strip& strip);
    void add_strip_along(double axis_x, double axis_y);
    double round_bottom(const CellPrism& prism) const;
    // Whether a strip separates the shape from a rectangle in plan.
    bool is_beside(const CellPrism& prism) const {
        const double x = 0.5 * (prism.west + prism.east) - shape_.centre[0];
        const double y = 0.5 * (prism.south + prism.north) - shape_.centre[1];
        for (std::size_t i = 0; i < strip_count_; ++i) {
            const LocalHull::Strip& strip = strips_[i];
            const double at = strip.x * x + strip.y * y;
            const double reach = 0.5 * (std::abs(strip.x) * (prism.east - prism.west) +
                                        std::abs(strip.y) * (prism.north - prism.south));
            if (at - reach > strip.high || at + reach < strip.low) return true;
        }
        return false;
    }

    const LocalShape& shape_;
    std::array<Plane, LocalHull::kMostPlanes> planes_;
    std::size_t count_ = 0;
    std::array<LocalHull::Strip, 3> strips_;  // contain the outline in plan, with some slack
    std::size_t strip_count_ = 0;
    double run_ = 0.0;
    double core_length_ = 0.0;
};

Underside::Underside(const LocalShape& shape) : shape_(shape) {
    const Eigen::Vector3d& c = shape.centre;
    if (shape.kind != ShapeKind::round) {
        visit_down_planes(shape, [&](const Eigen::Vector3d& n, double drop) {
            // the shape lies above the plane n . (p - c) = -drop
            if (n[2] < 1e-6) return;
            const double x = -n[0] / n[2];
            const double y = -n[1] / n[2];
            planes_[count_++] = {x, y, c[2] - drop / n[2] - x * c[0] - y * c[1]};
        });
        if (shape.kind == ShapeKind::box) {
            for (const Eigen::Vector3d& axis : shape.axes) add_strip_along(axis[0], axis[1]);
        } else if (shape.hull->is_narrow) {
            add_strip(shape.hull->strip);
        }
        return;
    }
    run_ = std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    core_length_ = length(shape.core);
}

void Underside::add_strip(const LocalHull::Strip& strip) {
    constexpr double kSlack = 1e-9;        // metres
    constexpr double kRounding = 0x1p-46;  // relative to the shape's size
    const double size = std::sqrt(strip.x * strip.x + strip.y * strip.y);
    const double slack = (kSlack + kRounding * (shape_.bounds[0] + shape_.bounds[1])) * size;
    strips_[strip_count_++] = {strip.x, strip.y, strip.low - slack, strip.high + slack};
}

// Adds the strip of a box that runs along one of its axes in plan.
void Underside::add_strip_along(double axis_x, double axis_y) {
    if (!(axis_x * axis_x + axis_y * axis_y > 1e-18))
        return;  // vertical axis: the other two form the outline
    const double x = -axis_y;
    const double y = axis_x;
    double reach = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& axis = shape_.axes[i];
        reach += std::abs(x * axis[0] + y * axis[1]) * shape_.half[static_cast<Eigen::Index>(i)];
    }
    add_strip({x, y, -reach, reach});
}

double Underside::round_bottom(const CellPrism& prism) const {
    constexpr double kSlack = 1e-9;  // metres
    const LocalShape& shape = shape_;
    const Eigen::Vector3d& c = shape.centre;
    double bottom = c[2] - shape.bounds[2];
    const double west = std::max(prism.west, c[0] - shape.bounds[0]) - c[0];
    const double east = std::min(prism.east, c[0] + shape.bounds[0]) - c[0];
    const double south = std::max(prism.south, c[1] - shape.bounds[1]) - c[1];
    const double north = std::min(prism.north, c[1] + shape.bounds[1]) - c[1];
    const double run = run_;
    if (run > 1e-3 * core_length_) {
        // Bound by the infinite cylinder around the core, which is lowest where the rectangle is nearest to its axis.
        const double ux = shape.core[0] / run;
        const double uy = shape.core[1] / run;
        const double across_low =
            std::min(-uy * west, -uy * east) + std::min(ux * south, ux * north);
        const double across_high =
            std::max(-uy * west, -uy * east) + std::max(ux * south, ux * north);
        // Slightly nearer, so that rounding leaves no gap between adjoining rectangles.
        const double across = std::max({0.0, across_low - kSlack, -across_high - kSlack});
        if (across > shape.radius) return std::numeric_limits<double>::infinity();
        const double slope = shape.core[2] / run;
        const double along_low = std::min(ux * west, ux * east) + std::min(uy * south, uy * north);
        const double along_high = std::max(ux * west, ux * east) + std::max(uy * south, uy * north);
        const double drop =
            std::sqrt(shape.radius * shape.radius - across * across) * (core_length_ / run);
        bottom = std::max(bottom, c[2] + std::min(slope * along_low, slope * along_high) - drop);
    }
    // Bound by the sphere around the whole core, at the nearest point of the rectangle.
    const double x = std::max({0.0, west, -east});
    const double y = std::max({0.0, south, -north});
    const double reach = shape.radius + core_length_;
    const double square = reach * reach - x * x - y * y;
    if (square < 0.0) return std::numeric_limits<double>::infinity();
    return std::max(bottom, c[2] - std::sqrt(square));
}

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
        // Slightly higher, to cover the rounding of the bound.
        const double slack = 1e-12 * (1.0 + std::abs(prism.high) + std::abs(c[2]));
        return underside_.may_reach(prism, prism.high - std::max(best, -1e300) + slack);
    }
    void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result_.error_m = std::max(result_.error_m, static_cast<double>(cell.error_m));
        ++cells_tested_;
        if (slabs_ && local_.is_whole(column, row) && visit_corners(cell, column, row)) return;
        for (const Triangle& triangle : local_.triangles(cell, column, row)) visit(triangle);
    }
    void visit(const Triangle& triangle) {
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
    // Computes the lift of a box at the corners of a cell. True if the lift is not larger elsewhere in the cell,
    // because one face of the box's underside covers the whole cell.
    bool visit_corners(const GroundCell& cell, std::int64_t column, std::int64_t row) {
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
            // the first triangle contains both southern corners
            result_.triangle = local_.triangles(cell, column, row)[which < 2 ? 0 : 1];
        }
        return is_over_all && (faces & (faces - 1)) == 0;
    }

    const LocalGround& local_;
    const LocalShape& shape_;
    Underside underside_;
    std::optional<BoxSlabs> slabs_;  ///< set for a box
    double floor_;
    double enough_;
    std::int64_t cells_tested_ = 0;
    GroundLift result_;
};

// Lift of a box or round shape over a window that holds the cells under the shape.
GroundLift find_lift(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
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

// The first point over the ground on the line from a shape's lowest to its highest point; the lowest point if there is
// none. The limits of the ground are taken from `cells`, which is clamped to them.
Eigen::Vector3d find_point_over_ground(const LocalGround& local, const CellRange& cells,
                                       const LocalShape& shape, const Eigen::Vector3d& lowest) {
    // On each side the range may include two cells beyond the ground.
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

// Visits the triangles of a range of cells that a window holds.
void visit_window(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                  const LocalShape& shape, LiftVisitor& visitor) {
    const WindowCells at(window, cells);
    const auto visit_over = [&](int column, int row) {
        if (!visitor.wants(local.cell_prism(window, column, row))) return;
        visitor.visit(local.triangle(window, column, row, true));
        visitor.visit(local.triangle(window, column, row, false));
    };
    // Starts with the cell under the lowest point: its lift is usually large and excludes most other cells.
    const Eigen::Vector3d lowest =
        shape.deepest_point(Eigen::Vector3d::UnitZ()) - local.corner(window);
    const int first_column =
        std::clamp(static_cast<int>(lowest[0] / local.spacing()), at.west, at.east);
    const int first_row =
        std::clamp(static_cast<int>(lowest[1] / local.spacing()), at.south, at.north);
    visit_over(first_column, first_row);
    for (int row = at.south; row <= at.north; ++row) {
        for (int column = at.west; column <= at.east; ++column) {
            if (column != first_column || row != first_row) visit_over(column, row);
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
    const LocalWindow* const window = local.window(cells, 0);
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
    // Starts with the cell under the lowest point and a few samples: their lifts exclude most other cells.
    const auto visit_at = [&](double x, double y) {
        const CellRange at = local.cells(x, y, x, y);
        if (at.west > at.east || at.south > at.north) return;
        const GroundCell cell = local.cell(at.east, at.north);
        if (cell.status == QueryStatus::ok) visitor.visit(cell, at.east, at.north);
    };
    const Eigen::Vector3d lowest = moved.deepest_point(Eigen::Vector3d::UnitZ());
    visit_at(lowest[0], lowest[1]);
    if (visitor.cells_tested() == 0) {
        const Eigen::Vector3d over = find_point_over_ground(local, cells, moved, lowest);
        visit_at(over[0], over[1]);
    }
    constexpr int kSamples = 8;  // along a side
    constexpr std::int64_t kMany = 4 * kSamples;
    if (cells.east - cells.west > kMany && cells.north - cells.south > kMany) {
        for (int i = 0; i < kSamples * kSamples && !visitor.has_enough(); ++i) {
            const int column = i % kSamples, row = i / kSamples;
            const double u = (column + 0.5) / kSamples;
            const double v = (row + 0.5) / kSamples;
            visit_at(low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1]));
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
            // Slightly higher, to cover the rounding of the bound.
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
    if (range.status == QueryStatus::outside) return -kInfinity;
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
