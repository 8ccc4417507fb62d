// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/ground.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::adapters {

/// The part of the contact surface to which a triangle belongs.
enum class TrianglePart {
    south,  ///< the southern triangle of a cell of the heightfield
    north,  ///< the northern triangle of a cell
    solid,  ///< a triangle of the joined solid: see SolidSurface
};

/// A triangle of the contact surface.
struct GroundTriangle {
    /// Metres relative to origin_world of the visit; counter-clockwise seen from outside the solid.
    std::array<Eigen::Vector3d, 3> corners{};
    TrianglePart part = TrianglePart::south;  ///< which triangle of the cell, or solid
    /// Cell of the contact level; for a solid triangle, the first cell of its chunk.
    std::int64_t column = 0, row = 0;
    std::uint32_t solid_index = 0;  ///< index of a solid triangle in its SolidSurface
};

/// Report of visit_triangles().
struct TriangleReport {
    /// The box is not finite, inverted or over too many cells; nothing was visited.
    bool is_refused = false;
    /// Absent ground (QueryStatus::not_resident) may reach into the box.
    bool meets_absent = false;
    std::size_t triangles = 0;  ///< visited
};

/// Default limit of the adapters for most_cells of visit_triangles().
inline constexpr std::int64_t kMostVisitedCells = std::int64_t{1} << 22;

namespace internal {

// Cells under a box, clipped to the extent; empty (west > east) if there are none.
inline CellRange cells_under(const Ground& ground, const Aabb& box_world) {
    const WorldRect& e = ground.extent();
    if (box_world.low.x() > e.east || box_world.high.x() < e.west || box_world.low.y() > e.north ||
        box_world.high.y() < e.south) {
        return {};
    }
    return {ground.column_at(std::max(box_world.low.x(), e.west)),
            ground.row_at(std::max(box_world.low.y(), e.south)),
            ground.column_at(std::min(box_world.high.x(), e.east)),
            ground.row_at(std::min(box_world.high.y(), e.north))};
}

// Whether the whole box is above the plane of a triangle whose corners are counter-clockwise from above.
inline bool is_above(const Aabb& box, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                     const Eigen::Vector3d& c) {
    const Eigen::Vector3d n = (b - a).cross(c - a);  // z > 0
    const Eigen::Vector3d lowest(n.x() > 0.0 ? box.low.x() : box.high.x(),
                                 n.y() > 0.0 ? box.low.y() : box.high.y(), box.low.z());
    return n.dot(lowest - a) > 0.0;
}

// Visits the triangles of the heightfield in a square of at most 32 cells that does not cross a chunk's border.
template <class Visit>
std::size_t visit_square(GroundReader& reader, const CellRange& cells, const Aabb& box,
                         const Eigen::Vector3d& origin_world, Visit& visit) {
    constexpr std::size_t kStride = 33;
    std::array<std::int32_t, kStride * kStride> quanta;
    std::array<std::uint32_t, kStride> ground_bits;
    reader.heights(cells, kStride, quanta, ground_bits);
    const Ground& ground = reader.ground();
    const double quantum = ground.lattice().quantum;
    const SolidSurface* const solid =
        ground.has_solids() ? ground.solid(cells.west, cells.south) : nullptr;
    std::size_t count = 0;
    for (std::int64_t row = cells.south; row <= cells.north; ++row) {
        const auto j = static_cast<std::size_t>(row - cells.south);
        const double south = ground.cell_y(row) - origin_world.y();
        const double north = ground.cell_y(row + 1) - origin_world.y();
        for (std::int64_t column = cells.west; column <= cells.east; ++column) {
            const auto i = static_cast<std::size_t>(column - cells.west);
            if ((ground_bits[j] >> i & 1u) == 0) continue;
            const std::int32_t* const q = &quanta[j * kStride + i];
            const auto [least, most] = std::minmax({q[0], q[1], q[kStride], q[kStride + 1]});
            if (quantum * most - origin_world.z() < box.low.z() ||
                quantum * least - origin_world.z() > box.high.z()) {
                continue;
            }
            const double west = ground.cell_x(column) - origin_world.x();
            const double east = ground.cell_x(column + 1) - origin_world.x();
            const auto z = [&](std::size_t k) { return quantum * q[k] - origin_world.z(); };
            const Eigen::Vector3d sw(west, south, z(0)), se(east, south, z(1));
            const Eigen::Vector3d nw(west, north, z(kStride)), ne(east, north, z(kStride + 1));
            const bool is_to_north_east = cut_to_north_east(column, row);
            const std::size_t cell = cell_index(static_cast<int>(column & (kChunkCells - 1)),
                                                static_cast<int>(row & (kChunkCells - 1)));
            const auto give = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c, TrianglePart part) {
                if (solid != nullptr && solid->is_replaced(cell, part == TrianglePart::north))
                    return;
                if (is_above(box, a, b, c)) return;
                ++count;
                visit(GroundTriangle{{a, b, c}, part, column, row, 0});
            };
            give(sw, se, is_to_north_east ? ne : nw, TrianglePart::south);
            give(is_to_north_east ? sw : se, ne, nw, TrianglePart::north);
        }
    }
    return count;
}

// Visits the triangles of the joined solid in one chunk.
template <class Visit>
std::size_t visit_solid(const Ground& ground, std::int64_t column, std::int64_t row,
                        const Aabb& box_world, const Eigen::Vector3d& origin_world, Visit& visit) {
    const SolidSurface* const solid = ground.solid(column, row);
    if (solid == nullptr) return 0;
    std::array<std::uint32_t, 256> found;
    std::size_t total = 0;
    std::uint32_t cursor = 0;
    for (std::size_t count = found.size(); count == found.size();) {
        count = solid->find_overlaps(box_world, cursor, found);
        for (std::size_t i = 0; i < count; ++i) {
            if (solid->is_kept_neighbour(found[i])) continue;
            GroundTriangle triangle;
            triangle.corners = solid->corners_world(found[i]);
            for (Eigen::Vector3d& corner : triangle.corners) corner -= origin_world;
            triangle.part = TrianglePart::solid;
            triangle.column = column;
            triangle.row = row;
            triangle.solid_index = found[i];
            ++total;
            visit(triangle);
        }
    }
    return total;
}

}  // namespace internal

/// Visits the triangles of the contact surface that may touch a box. Skips cells whose heights are all above or all
/// below the box, and triangles whose planes pass below the whole box. Where volumes replace triangles of the
/// heightfield, visits the triangles of the joined solid instead. Reports absent ground that may reach into the box.
///
/// @param box_world    metres
/// @param origin_world subtracted from every corner in double
/// @param most_cells   limit on cells of the extent under the box; above it the visit is refused
/// @param visit        called as visit(const GroundTriangle&), in an order that depends only on the ground and box
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      linear in the cells under the box; squares of 32 x 32 cells below or above the box are skipped
template <class Visit>
TriangleReport visit_triangles(const Ground& ground, const Aabb& box_world,
                               const Eigen::Vector3d& origin_world, std::int64_t most_cells,
                               Visit visit) {
    TriangleReport report;
    if (!box_world.low.allFinite() || !box_world.high.allFinite() ||
        !(box_world.low.array() <= box_world.high.array()).all()) {
        report.is_refused = true;
        return report;
    }
    const CellRange all = internal::cells_under(ground, box_world);
    if (all.west > all.east) return report;
    const std::int64_t columns = all.east - all.west + 1, rows = all.north - all.south + 1;
    if (columns > most_cells || rows > most_cells || columns > most_cells / rows) {
        report.is_refused = true;
        return report;
    }
    const Aabb box{box_world.low - origin_world, box_world.high - origin_world};
    const double quantum = ground.lattice().quantum;
    GroundReader reader(ground);
    constexpr int kLog2Side = 5;
    constexpr std::int64_t kSide = std::int64_t{1} << kLog2Side;
    for (std::int64_t row = all.south; row <= all.north; row = (row | (kSide - 1)) + 1) {
        for (std::int64_t column = all.west; column <= all.east;
             column = (column | (kSide - 1)) + 1) {
            const RangeAnswer range = reader.square(column, row, kLog2Side);
            if (range.status == QueryStatus::outside) continue;
            const CellRange cells{column, row, std::min(column | (kSide - 1), all.east),
                                  std::min(row | (kSide - 1), all.north)};
            const bool is_absent = range.status == QueryStatus::not_resident;
            // volumes may reach above and below the heightfield of a resident chunk
            const bool may_overlap = quantum * range.low <= box_world.high.z() &&
                                     quantum * range.high >= box_world.low.z();
            if (is_absent) {
                report.meets_absent = report.meets_absent ||
                                      (quantum * range.high >= box_world.low.z() &&
                                       ground.range(cells).status == QueryStatus::not_resident);
            } else if (may_overlap) {
                report.triangles += internal::visit_square(reader, cells, box, origin_world, visit);
            }
        }
    }
    if (!ground.has_solids()) return report;
    for (std::int64_t row = all.south & -kChunkCells; row <= all.north; row += kChunkCells) {
        for (std::int64_t column = all.west & -kChunkCells; column <= all.east;
             column += kChunkCells) {
            report.triangles +=
                internal::visit_solid(ground, column, row, box_world, origin_world, visit);
        }
    }
    return report;
}

/// Whether absent ground may reach into a moving box: compares the bottom of the swept box with the upper bound of
/// absent ground that coarser chunks give. True without a test if the box covers more than 65,536 chunks; false for a
/// box that is not finite.
///
/// Threads: any number at once
/// Cost:    O(chunks under the box)
inline bool may_meet_absent(const Ground& ground, const Aabb& box_world,
                            const Eigen::Vector3d& displacement) {
    constexpr std::int64_t kMostChunks = 1 << 16;
    const Aabb swept{box_world.low.cwiseMin(box_world.low + displacement),
                     box_world.high.cwiseMax(box_world.high + displacement)};
    if (!swept.low.allFinite() || !swept.high.allFinite()) return false;
    const CellRange cells = internal::cells_under(ground, swept);
    if (cells.west > cells.east || cells.south > cells.north) return false;
    const std::int64_t columns = (cells.east - cells.west) / kChunkCells + 2;
    const std::int64_t rows = (cells.north - cells.south) / kChunkCells + 2;
    if (columns > kMostChunks || rows > kMostChunks || columns * rows > kMostChunks) return true;
    const RangeAnswer range = ground.range(cells);
    return range.status == QueryStatus::not_resident &&
           range.high * ground.lattice().quantum >= swept.low.z();
}

}  // namespace terrane::adapters
