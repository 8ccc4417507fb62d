// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "ground/column/local_ground.h"

#include <terrane/base/math.h>

#include <array>

namespace terrane::internal {

/// Which side of the joined surface a point lies on.
enum class SurfaceSide {
    air,
    solid,
    unknown,  ///< ground there is not resident
};

/// A triangle of the joined surface: corners counter-clockwise seen from outside the solid, normal outward, with z < 0
/// for ceilings.
using SurfaceTriangle = Triangle;

/// Whether a query in a box must test triangles of volumes. False if the heightfield is the only solid that the box
/// could meet, as in worlds without volumes and above everything.
///
/// Cost: one comparison in worlds without volumes, else O(log n) for n triangles of volumes
bool is_near_volume(const Ground& ground, const Aabb& box_world);

/// The surface of the joined solid as triangles in the frame of a LocalGround: the triangles of volumes, and the
/// triangles of the heightfield that volumes do not replace.
///
/// Threads: one, as for LocalGround
class SurfaceTriangles {
public:
    explicit SurfaceTriangles(const LocalGround& local) : local_(local) {}

    const LocalGround& local() const { return local_; }

    /// Calls `visitor(const SurfaceTriangle&)` for the triangles that may overlap a box, in a deterministic order.
    /// False if ground that is not resident may reach the box.
    template <class Visitor>
    bool visit(const Aabb& box, Visitor&& visitor) const {
        return visit(
            box, [](const std::array<Eigen::Vector3d, 3>&) { return true; }, visitor);
    }
    /// As above, with a filter `wants(corners)` that applies to the triangles of volumes only.
    template <class Wants, class Visitor>
    bool visit(const Aabb& box, const Wants& wants, Visitor&& visitor) const {
        const CellRange cells = local_.cells(box.low[0], box.low[1], box.high[0], box.high[1]);
        if (cells.east < cells.west || cells.north < cells.south) return true;
        FieldVisitor<Visitor> field{*this, box, visitor};
        visit_cells(local_, cells, field);
        visit_solids(local_.ground(), cells, [&](const SolidSurface& solid, const CellRange&) {
            visit_solid(solid, box, wants, visitor);
        });
        return !field.is_missing;
    }

    /// Whether a box is clear of triangles and of ground that is not resident. The search stops at the first one found.
    bool is_empty(const Aabb& box) const;

    /// Which side of the surface a convex set lies on. No triangle may cross the set.
    ///
    /// @param inside a point of the set
    /// @param reach  radius of a ball around `inside` that the set contains, metres
    SurfaceSide side_of(const Eigen::Vector3d& inside, double reach) const;

    /// Largest error_m of the cells and solids under and over a box, metres.
    double error(const Aabb& box) const;

private:
    /// A box in world coordinates, slightly wider to cover the rounding of the frame.
    Aabb to_world(const Aabb& box) const {
        const Eigen::Vector3d origin = local_.to_world(Eigen::Vector3d::Zero());
        const Eigen::Vector3d hair =
            Eigen::Vector3d::Constant(1e-9 * (1.0 + 1e-6 * origin.cwiseAbs().maxCoeff()));
        return {box.low + origin - hair, box.high + origin + hair};
    }
    template <class Wants, class Visitor>
    void visit_solid(const SolidSurface& solid, const Aabb& box, const Wants& wants,
                     Visitor&& visitor) const {
        const Aabb box_world = to_world(box);
        std::array<std::uint32_t, 32> found;
        std::uint32_t cursor = 0;
        for (std::size_t count = found.size(); count == found.size();) {
            count = solid.find_overlaps(box_world, cursor, found);
            for (std::size_t i = 0; i < count; ++i) {
                if (solid.is_kept_neighbour(found[i])) continue;  // part of the heightfield
                std::array<Eigen::Vector3d, 3> v = solid.corners_world(found[i]);
                for (Eigen::Vector3d& corner : v) corner = local_.to_local(corner);
                if (!wants(v)) continue;
                const Eigen::Vector3d n = cross(v[1] - v[0], v[2] - v[0]);
                const double size = length(n);
                // A triangle without area lies on edges of its neighbours.
                if (size > 0.0) visitor(SurfaceTriangle{v, n / size});
            }
        }
    }

    template <class Visitor>
    struct FieldVisitor {
        const SurfaceTriangles& triangles;
        const Aabb& box;
        Visitor& visit_triangle;
        bool is_missing = false;
        const SolidSurface* solid = nullptr;  // solid of the chunk of the last cell
        std::int64_t chunk_column = 0, chunk_row = 0;
        bool has_chunk = false;

        bool wants(const CellPrism& prism) const {
            return prism.high >= box.low[2] && prism.low <= box.high[2];
        }
        bool miss(const CellPrism& prism) {
            is_missing = is_missing || prism.high >= box.low[2];
            return true;
        }
        void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
            if (!has_chunk || column >> kChunkLog2 != chunk_column ||
                row >> kChunkLog2 != chunk_row) {
                solid = triangles.local_.ground().solid(column, row);
                chunk_column = column >> kChunkLog2;
                chunk_row = row >> kChunkLog2;
                has_chunk = true;
            }
            const auto index = static_cast<std::size_t>((row & (kChunkCells - 1)) * kChunkCells +
                                                        (column & (kChunkCells - 1)));
            const CellTriangles all = triangles.local_.triangles(cell, column, row);
            for (std::size_t i = 0; i < all.count; ++i) {
                const bool is_north = i >= all.south_count;
                if (solid != nullptr && solid->is_replaced(index, is_north)) continue;
                visit_triangle(all[i]);
            }
        }
    };

    const LocalGround& local_;
};

}  // namespace terrane::internal
