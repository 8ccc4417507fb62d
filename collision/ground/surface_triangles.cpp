// SPDX-License-Identifier: MIT
#include "ground/surface_triangles.h"

#include "ground/column/local_ground.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// The cells under a box, clamped to the extent; empty if the box is outside.
CellRange cells_under(const Ground& ground, const Aabb& box) {
    const WorldRect& extent = ground.extent();
    if (!(box.low.x() <= extent.east && box.high.x() >= extent.west &&
          box.low.y() <= extent.north && box.high.y() >= extent.south)) {
        return {};
    }
    // A side on a lattice line touches the cells on both sides of it.
    return {ground.column_at(std::max(box.low.x(), extent.west)) - 1,
            ground.row_at(std::max(box.low.y(), extent.south)) - 1,
            ground.column_at(std::min(box.high.x(), extent.east)),
            ground.row_at(std::min(box.high.y(), extent.north))};
}

bool has_overlap(const SolidSurface& solid, const Aabb& box) {
    std::array<std::uint32_t, 1> found;
    std::uint32_t cursor = 0;
    return solid.find_overlaps(box, cursor, found) > 0;
}

bool has_contour(const SolidSurface& solid, const Aabb& box) {
    std::array<std::uint32_t, 16> found;
    std::uint32_t cursor = 0;
    for (std::size_t count = found.size(); count == found.size();) {
        count = solid.find_overlaps(box, cursor, found);
        for (std::size_t i = 0; i < count; ++i) {
            if (!solid.is_kept_neighbour(found[i])) return true;
        }
    }
    return false;
}

/// Height of the heightfield's triangles over or under a point, metres; minus infinity if there is no ground.
double field_height(const Ground& ground, const WorldPos& point) {
    if (!ground.extent().contains(point.x(), point.y())) return -kInfinity;
    const std::int64_t column = ground.column_at(point.x()), row = ground.row_at(point.y());
    const GroundCell cell = ground.cell(column, row);
    if (cell.status != QueryStatus::ok) return -kInfinity;
    const LocalGround local(ground, point);
    const std::array<Triangle, 2> both = local.whole_triangles(cell, column, row);
    const Eigen::Vector3d p = local.to_local(point);
    return point.z() + TrianglePlane(both[is_over(p, both[0]) ? 0 : 1]).above(p);
}

bool has_replaced(const SolidSurface& solid, const CellRange& in_chunk) {
    for (std::int64_t row = in_chunk.south; row <= in_chunk.north; ++row) {
        for (std::int64_t column = in_chunk.west; column <= in_chunk.east; ++column) {
            const auto cell = static_cast<std::size_t>(row * kChunkCells + column);
            if (solid.is_replaced(cell, false) || solid.is_replaced(cell, true)) return true;
        }
    }
    return false;
}

}  // namespace

bool is_near_volume(const Ground& ground, const Aabb& box_world) {
    if (!ground.has_solids()) return false;
    if (!is_finite(box_world.low) || !is_finite(box_world.high)) return false;
    const CellRange cells = cells_under(ground, box_world);
    if (cells.east < cells.west || cells.north < cells.south) return false;
    // Boxes over so many chunks are not searched: sweeps of this size are cut into pieces anyway.
    constexpr std::int64_t kMostCells = 64 * kChunkCells;
    if (cells.east - cells.west > kMostCells || cells.north - cells.south > kMostCells) return true;
    bool meets = false;
    visit_solids(ground, cells, [&](const SolidSurface& solid, const CellRange&) {
        meets = meets || has_contour(solid, box_world);
    });
    if (meets) return true;
    // Extended to all heights, the box overlaps the triangles of volumes that lie over or under it.
    Aabb columns = box_world;
    columns.low.z() = -kInfinity;
    columns.high.z() = kInfinity;
    bool is_touched = false;
    double top = -kInfinity;
    visit_solids(ground, cells, [&](const SolidSurface& solid, const CellRange& in_chunk) {
        if (!has_overlap(solid, columns)) return;
        is_touched = true;
        top = std::max(top, solid.bounds().high.z());
        meets = meets || has_replaced(solid, in_chunk);
    });
    if (!is_touched) return false;
    const RangeAnswer range = ground.range(cells);
    const double quantum = ground.lattice().quantum;
    const double high = range.status == QueryStatus::outside ? -kInfinity : quantum * range.high;
    if (box_world.low.z() > std::max(high, top)) return false;  // above everything
    if (meets) return true;
    // No contour is in the box, and no mouth is over or under it. If the heightfield passes through the box, it is the
    // only surface there; otherwise the whole box is above or below the heightfield.
    const Eigen::Vector3d centre = 0.5 * (box_world.low + box_world.high);
    return field_height(ground, centre) > box_world.high.z();
}

bool SurfaceTriangles::is_empty(const Aabb& box) const {
    const CellRange cells = local_.cells(box.low[0], box.low[1], box.high[0], box.high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return true;
    bool is_any = false;
    visit_solids(local_.ground(), cells, [&](const SolidSurface& solid, const CellRange&) {
        is_any = is_any || has_contour(solid, to_world(box));
    });
    if (is_any) return false;
    struct Finder {
        const SurfaceTriangles& triangles;
        const Aabb& box;
        bool& is_any;
        bool wants(const CellPrism& prism) const {
            return !is_any && prism.high >= box.low[2] && prism.low <= box.high[2];
        }
        bool miss(const CellPrism& prism) {
            is_any = is_any || prism.high >= box.low[2];
            return !is_any;
        }
        void visit(const GroundCell&, std::int64_t column, std::int64_t row) {
            const SolidSurface* const solid = triangles.local_.ground().solid(column, row);
            const auto index = static_cast<std::size_t>((row & (kChunkCells - 1)) * kChunkCells +
                                                        (column & (kChunkCells - 1)));
            is_any = is_any || solid == nullptr || !solid->is_replaced(index, false) ||
                     !solid->is_replaced(index, true);
        }
    };
    Finder finder{*this, box, is_any};
    visit_cells(local_, cells, finder);
    return !is_any;
}

SurfaceSide SurfaceTriangles::side_of(const Eigen::Vector3d& inside, double reach) const {
    // A vertical line may pass through an edge between a floor and a ceiling, so three points must agree.
    const std::array<Eigen::Vector3d, 3> points{
        inside, inside + reach * Eigen::Vector3d(0.37, -0.23, 0.11),
        inside + reach * Eigen::Vector3d(-0.19, 0.31, 0.07)};
    for (const Eigen::Vector3d& point : points) {
        const WorldPos p = local_.to_world(point);
        const HeightAnswer below = local_.ground().height_below(p.x(), p.y(), p.z());
        if (below.status == QueryStatus::not_resident) return SurfaceSide::unknown;
        const bool is_solid = below.status == QueryStatus::miss ||
                              (below.status == QueryStatus::ok && below.normal.z() < 0.0);
        if (!is_solid) return SurfaceSide::air;
    }
    return SurfaceSide::solid;
}

double SurfaceTriangles::error(const Aabb& box) const {
    const CellRange cells = local_.cells(box.low[0], box.low[1], box.high[0], box.high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return 0.0;
    double error = local_.error(cells);
    visit_solids(local_.ground(), cells, [&](const SolidSurface& solid, const CellRange&) {
        error = std::max(error, solid.triangles().error_m);
    });
    return error;
}

}  // namespace terrane::internal
