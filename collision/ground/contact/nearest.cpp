// SPDX-License-Identifier: MIT
#include "ground/contact/nearest.h"

#include "ground/column/normal_cone.h"

namespace terrane::internal {
namespace {

struct NearestVisitor {
    const LocalGround& local;
    const LocalShape& shape;
    double best;
    Nearest result;

    bool wants(const CellPrism& prism) const { return bound_distance(shape, prism) <= best; }
    bool miss(const CellPrism& prism) {
        if (wants(prism)) result.is_missing = true;
        return true;
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result.error_m = std::max(result.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) {
            if (gap_along(triangle.normal, shape, triangle) > best) continue;
            if (shape.kind == ShapeKind::box &&
                find_separation(shape, triangle, false).gap > best) {
                continue;
            }
            const ClosestPair pair = find_closest(shape, triangle);
            if (pair.distance > best || (result.is_found && pair.distance >= best)) continue;
            best = pair.distance;
            result.is_found = true;
            result.distance = pair.distance;
            result.on_shape = pair.on_shape;
            result.triangle = triangle;
            const Eigen::Vector3d apart = pair.on_shape - pair.on_triangle;
            const double size = length(apart);
            if (size > kTouch) {
                result.normal = apart / size;
            } else {
                result.normal = find_separation(shape, triangle, false).normal;
            }
        }
    }
};

// The nearest of one shape within a distance.
Nearest find_within(const LocalGround& local, const LocalShape& shape, double reach) {
    NearestVisitor visitor{local, shape, reach, {}};
    const Eigen::Vector3d low = shape.centre - shape.bounds;
    const Eigen::Vector3d high = shape.centre + shape.bounds;
    // The cell under the lowest point first, so that bounds exclude most others.
    const Eigen::Vector3d lowest = shape.deepest_point(Eigen::Vector3d::UnitZ());
    const CellRange first = local.cells(lowest[0], lowest[1], lowest[0], lowest[1]);
    if (first.west <= first.east && first.south <= first.north) {
        const GroundCell cell = local.cell(first.east, first.north);
        if (cell.status == GroundStatus::ok) visitor.take(cell, first.east, first.north);
    }
    visit_cells(local,
                local.cells(low[0] - reach, low[1] - reach, high[0] + reach, high[1] + reach),
                visitor);
    return visitor.result;
}

Nearest find_within(const LocalGround& local, const LocalBody& body, double reach) {
    Nearest all;
    all.distance = reach;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const Eigen::Vector3d around = bounds + Eigen::Vector3d::Constant(all.distance);
            return centre[2] - around[2] <= bound_ground(local, centre, around);
        },
        [&](const LocalShape& shape, std::uint32_t part) {
            const Nearest found = find_within(local, shape, all.distance);
            all.error_m = std::max(all.error_m, found.error_m);
            all.is_missing = all.is_missing || found.is_missing;
            if (!found.is_found || (all.is_found && found.distance >= all.distance)) return;
            all.is_found = true;
            all.distance = found.distance;
            all.on_shape = found.on_shape;
            all.normal = found.normal;
            all.part = part;
            all.triangle = found.triangle;
        });
    return all;
}

}  // namespace

ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle) {
    if (shape.kind == ShapeKind::box) return find_closest_box(shape, triangle);
    if (shape.kind == ShapeKind::hull) {
        return find_closest_hull(*shape.hull, shape.centre, triangle);
    }
    ClosestPair pair = find_closest_core(shape.centre, shape.core, triangle);
    const double distance = pair.distance;
    if (distance > 0.0) {
        pair.on_shape += (shape.radius / distance) * (pair.on_triangle - pair.on_shape);
    }
    pair.distance = std::max(0.0, distance - shape.radius);
    return pair;
}

Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance) {
    // Ever larger distances, so that a far limit costs nothing where the ground is near.
    double reach = std::min(max_distance, local.spacing());
    for (;;) {
        const Nearest nearest = find_within(local, body, reach);
        if (nearest.is_found || nearest.is_missing || reach >= max_distance) return nearest;
        reach = std::min(max_distance, 4.0 * reach);
    }
}

bool add_nearest(const LocalGround& local, const LocalBody& body, double margin,
                 ContactPatches& patches) {
    if (!body.is_compound() && body.whole().kind == ShapeKind::round) return true;
    const Nearest nearest = find_nearest(local, body, margin);
    if (!nearest.is_found || !is_in_normal_cone(local, nearest.triangle, nearest.normal)) {
        return !nearest.is_missing;
    }
    LocalHull hull;
    const ShapeFeature feature = body.part(nearest.part, hull).deepest(nearest.normal).feature;
    patches.add(
        make_contact(nearest.on_shape, nearest.normal, -nearest.distance, feature, nearest.part));
    return true;
}

}  // namespace terrane::internal
