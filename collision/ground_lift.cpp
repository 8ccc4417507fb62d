// SPDX-License-Identifier: MIT
#include "ground_lift.h"

namespace terrane::internal {
namespace {

// The lowest z that a shape could have over a rectangle: that of its supporting planes.
double bound_bottom(const LocalShape& shape, const Prism& prism) {
    const Eigen::Vector3d& c = shape.centre;
    double bottom = c[2] - shape.bounds[2];
    const double west = std::max(prism.west, c[0] - shape.bounds[0]) - c[0];
    const double east = std::min(prism.east, c[0] + shape.bounds[0]) - c[0];
    const double south = std::max(prism.south, c[1] - shape.bounds[1]) - c[1];
    const double north = std::min(prism.north, c[1] + shape.bounds[1]) - c[1];
    if (shape.is_box) {
        for (std::size_t i = 0; i < 3; ++i) {
            // n looks up; the box lies above the plane n . (p - c) = -half
            const Eigen::Vector3d n =
                shape.axes[i][2] < 0.0 ? Eigen::Vector3d(-shape.axes[i]) : shape.axes[i];
            if (n[2] < 1e-6) continue;
            const double most =
                std::max(n[0] * west, n[0] * east) + std::max(n[1] * south, n[1] * north);
            bottom =
                std::max(bottom, c[2] + (-shape.half[static_cast<Eigen::Index>(i)] - most) / n[2]);
        }
        return bottom;
    }
    const double run = std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    if (run > 1e-3 * length(shape.core)) {
        // The endless cylinder around the core: lowest where the rectangle comes nearest to its axis.
        const double ux = shape.core[0] / run;
        const double uy = shape.core[1] / run;
        const double across_low =
            std::min(-uy * west, -uy * east) + std::min(ux * south, ux * north);
        const double across_high =
            std::max(-uy * west, -uy * east) + std::max(ux * south, ux * north);
        // A hair nearer, so that rounding loses nothing on a seam.
        const double across = std::max({0.0, across_low - kTouch, -across_high - kTouch});
        if (across > shape.radius) return std::numeric_limits<double>::infinity();
        const double slope = shape.core[2] / run;
        const double along_low = std::min(ux * west, ux * east) + std::min(uy * south, uy * north);
        const double along_high = std::max(ux * west, ux * east) + std::max(uy * south, uy * north);
        const double drop =
            std::sqrt(shape.radius * shape.radius - across * across) * (length(shape.core) / run);
        bottom = std::max(bottom, c[2] + std::min(slope * along_low, slope * along_high) - drop);
    }
    // The ball around the whole core, from the rectangle's nearest point.
    const double x = std::max({0.0, west, -east});
    const double y = std::max({0.0, south, -north});
    const double reach = shape.radius + length(shape.core);
    const double square = reach * reach - x * x - y * y;
    if (square < 0.0) return std::numeric_limits<double>::infinity();
    return std::max(bottom, c[2] - std::sqrt(square));
}

struct LiftVisitor {
    const LocalGround& local;
    const LocalShape& shape;
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
        // A hair below, for what rounding does to the bound.
        const double bound = prism.high - bound_bottom(shape, prism);
        return bound + 1e-12 * (1.0 + std::abs(bound)) > std::max(floor, result.lift);
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result.error_m = std::max(result.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) {
            const double best = std::max(floor, result.lift);
            if (!(bound_column_lift(shape, triangle) > best)) continue;
            const double lift = compute_column_lift(shape, triangle);
            if (lift > result.lift) {
                result.lift = lift;
                result.triangle = triangle;
            }
        }
    }
    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        result.is_missing = true;
        return false;
    }
};

}  // namespace

GroundLift find_lift(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& d,
                     double floor, double enough) {
    LocalShape moved = shape;
    moved.centre += d;
    const Eigen::Vector3d low = moved.centre - moved.bounds;
    const Eigen::Vector3d high = moved.centre + moved.bounds;
    LiftVisitor visitor{local, moved, floor, enough, {}};
    // The cell under the lowest point first: most others need only be bounded after it.
    const Eigen::Vector3d lowest = moved.deepest_point(Eigen::Vector3d::UnitZ());
    const CellRange first = local.cells(lowest[0], lowest[1], lowest[0], lowest[1]);
    if (first.west <= first.east && first.south <= first.north) {
        const GroundCell cell = local.cell(first.east, first.north);
        if (cell.status == GroundStatus::ok) visitor.take(cell, first.east, first.north);
        if (visitor.result.lift > enough) return visitor.result;
    }
    visit_cells(local, local.cells(low[0], low[1], high[0], high[1]), visitor);
    return visitor.result;
}

}  // namespace terrane::internal
