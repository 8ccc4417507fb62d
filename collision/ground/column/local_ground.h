// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Slopes along x and y of a triangle of a window, metres per cell.
struct WindowSlopes {
    double x, y;
};

/// The largest lift over a window, and the triangle that attains it: the southern or northern one of a cell.
struct WindowLift {
    double lift = -std::numeric_limits<double>::infinity();
    int column = 0, row = 0;
    bool is_south = false;
};

/// The heights of a few cells, read once and used by many queries of small shapes.
///
/// Columns and rows count cells from the south-western corner; heights are metres above `base` of read().
struct LocalWindow {
    static constexpr int kMostCells = 18;  ///< along a side
    static constexpr int kStride = kMostCells + 1;

    CellRange cells;       ///< lattice indices; empty until read()
    int columns = 0;       ///< of cells
    int rows = 0;          ///< of cells
    bool is_odd = false;   ///< whether column + row of the south-western corner is odd
    bool is_full = false;  ///< whether all cells are ground
    double high = 0.0;     ///< highest corner, metres
    std::array<std::uint32_t, kMostCells> ground;  ///< [rows] bit `column` is set if ground
    std::array<double, static_cast<std::size_t>(kStride) * kStride>
        z;  ///< heights of corners, row by row

    static std::size_t index(int column, int row) {
        return static_cast<std::size_t>(row * kStride + column);
    }
    /// Height of the vertex (column, row), metres.
    double at(int column, int row) const { return z[index(column, row)]; }
    /// Whether a cell of the window is ground.
    bool is_ground(int column, int row) const {
        return is_full || (ground[static_cast<std::size_t>(row)] >> column & 1u) != 0;
    }
    /// Whether the diagonal of a cell runs from its south-western corner to its north-eastern one.
    bool is_cut_to_north_east(int column, int row) const {
        return (((column + row) & 1) != 0) == is_odd;
    }
    /// Height of a cell's highest corner, metres.
    double highest(int column, int row) const {
        return std::max(
            {at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)});
    }
    /// Slopes of a cell's southern or northern triangle.
    WindowSlopes slopes(int column, int row, bool is_south) const {
        const int y = is_south ? row : row + 1;
        const int x = is_south == is_cut_to_north_east(column, row) ? column + 1 : column;
        return {at(column + 1, y) - at(column, y), at(x, row + 1) - at(x, row)};
    }
    /// Whether a range lies inside the window.
    bool holds(const CellRange& range) const {
        return range.west >= cells.west && range.east <= cells.east && range.south >= cells.south &&
               range.north <= cells.north;
    }
    /// Whether all cells of a range are ground. Requires holds(range).
    bool is_ground(const CellRange& range) const;

    /// Reads the heights of a range of cells. False if the range is empty or has more than kMostCells along a side.
    ///
    /// @param base    height of z = 0, quanta
    /// @param quantum of the heights, metres
    bool read(GroundReader& reader, const CellRange& range, std::int64_t base, double quantum);
};

/// A triangle of the contact surface, counter-clockwise from above; its column is everything on or below it.
struct Triangle {
    std::array<Eigen::Vector3d, 3> v;
    Eigen::Vector3d normal;  ///< unit, z > 0
};

/// Makes a triangle from its corners, counter-clockwise from above.
inline Triangle make_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& c) {
    const Eigen::Vector3d n = cross(b - a, c - a);
    return {{a, b, c}, n / length(n)};
}

/// Whether the projection of a point onto a triangle's plane lies in the triangle. A tolerance keeps rounding from
/// excluding a point at a shared edge from both triangles.
inline bool is_foot_inside(const Eigen::Vector3d& p, const Triangle& triangle) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& a = triangle.v[i];
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - a;
        if (dot(cross(edge, p - a), triangle.normal) < -1e-12 * dot(edge, edge)) return false;
    }
    return true;
}

/// The triangles of a cell. Those that an edge of the extent cuts are clipped and split.
struct CellTriangles {
    static constexpr std::size_t kMost =
        10;  ///< five for each of two triangles clipped by four edges
    std::array<Triangle, kMost> triangles;
    std::size_t count = 0;
    std::size_t south_count = 0;  ///< the first ones are parts of the southern triangle

    const Triangle* begin() const { return triangles.data(); }
    const Triangle* end() const { return triangles.data() + count; }
    const Triangle& operator[](std::size_t i) const { return triangles[i]; }
};

/// The vertical prism over a rectangle of cells with its top at `high` and no bottom. It contains the ground there,
/// whose surface is nowhere below `low`. Metres, local frame.
struct CellPrism {
    double west = 0.0, south = 0.0, east = 0.0, north = 0.0, high = 0.0;
    double low = -std::numeric_limits<double>::infinity();
};

/// The ground in a local frame whose origin is a lattice point near the query. Lattice indices are subtracted as
/// integers before conversion to lengths, so that results do not depend on the position in the world.
///
/// Threads: one; each query makes its own LocalGround
class LocalGround {
public:
    LocalGround(const Ground& ground, const WorldPos& near_world);
    /// The ground of `other` in a frame with its origin near a point. The two origins differ by whole cells and quanta.
    LocalGround(const LocalGround& other, const Eigen::Vector3d& near);
    LocalGround(const LocalGround&) = delete;
    LocalGround& operator=(const LocalGround&) = delete;

    Eigen::Vector3d to_local(const WorldPos& p_world) const { return p_world - origin_world_; }
    WorldPos to_world(const Eigen::Vector3d& p) const { return p + origin_world_; }
    double spacing() const { return spacing_; }
    double inverse_spacing() const { return inverse_spacing_; }
    const Ground& ground() const { return reader_.ground(); }

    /// Cells that a closed rectangle intersects, clamped to the ground's extent plus a border of one cell.
    CellRange cells(double west, double south, double east, double north) const;

    /// The prism over a range of cells with heights between `low` and `high`, quanta.
    CellPrism prism(const CellRange& cells, std::int32_t low, std::int32_t high) const;
    /// The prism over a cell of a window.
    CellPrism cell_prism(const LocalWindow& window, int column, int row) const {
        const std::int64_t east = window.cells.west + column;
        const std::int64_t north = window.cells.south + row;
        return {x(east), y(north), x(east + 1), y(north + 1), window.highest(column, row)};
    }
    GroundCell cell(std::int64_t column, std::int64_t row) const {
        return reader_.cell(column, row);
    }
    /// A window over a range of cells, widened by `ring` cells on each side; valid until the next call. Null if this is
    /// too many cells, or if a cell of the range itself is not ground, not resident or cut by an edge of the extent.
    ///
    /// @param ring 0 or 1
    const LocalWindow* window(const CellRange& cells, int ring) const;
    /// Whether a cell is ground and resident.
    bool is_ground(std::int64_t column, std::int64_t row) const {
        if (window_.holds({column, row, column, row})) {
            return window_.is_ground(static_cast<int>(column - window_.cells.west),
                                     static_cast<int>(row - window_.cells.south));
        }
        return cell(column, row).status == QueryStatus::ok;
    }
    /// Whether all cells of a range are ground and resident, and lie within the extent. Cost: O(chunks); O(cells) in
    /// chunks that are partly ground
    bool is_all_ground(const CellRange& cells) const { return reader_.is_all_ground(cells); }
    /// Finds a vertex of the contact surface; false if none of the cells around it is ground and resident.
    bool find_vertex(std::int64_t column, std::int64_t row, Eigen::Vector3d& p_out) const;
    /// Largest error_m of the cells of a range that are ground and resident, metres.
    double error(const CellRange& cells) const;
    /// The south-western corner of a window, at z = 0.
    Eigen::Vector3d corner(const LocalWindow& window) const {
        return {x(window.cells.west), y(window.cells.south), 0.0};
    }
    /// A vertex of a window.
    Eigen::Vector3d vertex(const LocalWindow& window, int column, int row) const {
        return {x(window.cells.west + column), y(window.cells.south + row), window.at(column, row)};
    }
    /// The southern or northern triangle of a window's cell; corners() omits the normal.
    Triangle triangle(const LocalWindow& window, int column, int row, bool is_south) const {
        const std::array<Eigen::Vector3d, 3> v = corners(window, column, row, is_south);
        return make_triangle(v[0], v[1], v[2]);
    }
    std::array<Eigen::Vector3d, 3> corners(const LocalWindow& window, int column, int row,
                                           bool is_south) const;
    RangeAnswer square(std::int64_t column, std::int64_t row, int log2_side) const {
        return reader_.square(column, row, log2_side);
    }
    /// Whether a cell lies within the extent, so that no edge cuts it.
    bool is_whole(std::int64_t column, std::int64_t row) const {
        return ground().is_within_extent({column, row, column, row});
    }
    /// The triangles of a cell whose status is ok.
    CellTriangles triangles(const GroundCell& cell, std::int64_t column, std::int64_t row) const;
    /// The two triangles of a cell whose status is ok as if no edge cut it; the southern one first.
    std::array<Triangle, 2> whole_triangles(const GroundCell& cell, std::int64_t column,
                                            std::int64_t row) const;
    /// Indices of the cell that contains a triangle.
    std::array<std::int64_t, 2> cell_of(const Triangle& triangle) const;
    double x(std::int64_t column) const { return spacing_ * static_cast<double>(column - column_); }
    double y(std::int64_t row) const { return spacing_ * static_cast<double>(row - row_); }
    /// Lattice indices of coordinates that x() and y() returned.
    std::int64_t column_of(double x) const {
        return column_ + static_cast<std::int64_t>(std::floor(x / spacing_ + 0.5));
    }
    std::int64_t row_of(double y) const {
        return row_ + static_cast<std::int64_t>(std::floor(y / spacing_ + 0.5));
    }
    double z(std::int32_t height) const { return quantum_ * static_cast<double>(height - base_); }
    /// Number of cells tested by lifts over ranges too large for a window; searches use it to limit their work.
    std::int64_t cells_tested() const { return cells_tested_; }
    void add_cells_tested(std::int64_t count) const { cells_tested_ += count; }

private:
    void set_origin();

    mutable GroundReader reader_;
    mutable LocalWindow window_;
    mutable CellRange error_cells_;  ///< argument of the last call of error()
    mutable double error_ = 0.0;     ///< result of that call
    mutable std::int64_t cells_tested_ = 0;
    double spacing_;
    double inverse_spacing_;
    double quantum_;
    std::int64_t column_ = 0;
    std::int64_t row_ = 0;
    std::int64_t base_ = 0;  ///< quanta
    WorldPos origin_world_;
};

/// Visits the cells of a range top down, through blocks of 2^k x 2^k cells with known height ranges. The visitor has
///   bool wants(const CellPrism&)                whether to visit the cells in this prism
///   void visit(const GroundCell&, column, row)  visits a cell that is ground
///   bool miss(const CellPrism&)                 reports a cell that is not resident, with its known height bounds;
///                                               false stops the traversal
/// and may have
///   bool visit_square(const CellRange&)         visits up to 16 x 16 cells at once; false: they are visited one by one
template <class Visitor>
void visit_cells(const LocalGround& local, const CellRange& all, Visitor& visitor) {
    constexpr std::int64_t kFew = 4;  // cells along a side; ranges up to this use no blocks
    constexpr int kLargest = 7;       // log2 of cells along a side; a block is at most a chunk
    constexpr int kSmallest = 2;
    constexpr int kSquare = 4;  // a window holds such a block and one more cell on each side
    static_assert((1 << kSquare) + 2 <= LocalWindow::kMostCells);
    if (all.east < all.west || all.north < all.south) return;
    const bool is_small = all.east - all.west < kFew && all.north - all.south < kFew;
    const auto visit_each = [&](const CellRange& r) {
        for (std::int64_t row = r.south; row <= r.north; ++row) {
            for (std::int64_t column = r.west; column <= r.east; ++column) {
                const GroundCell cell = local.cell(column, row);
                if (cell.status == QueryStatus::ok) {
                    const auto [low, high] = std::minmax(
                        {cell.south_west, cell.south_east, cell.north_west, cell.north_east});
                    if (visitor.wants(local.prism({column, row, column, row}, low, high))) {
                        visitor.visit(cell, column, row);
                    }
                } else if (cell.status == QueryStatus::not_resident) {
                    const CellRange only{column, row, column, row};
                    const RangeAnswer range = local.ground().range(only);
                    const std::int32_t high = range.high;
                    CellPrism prism = local.prism(only, range.low, high);
                    if (high == std::numeric_limits<std::int32_t>::max()) {
                        prism.high = std::numeric_limits<double>::infinity();
                    }
                    if (!visitor.miss(prism)) return false;
                }
            }
        }
        return true;
    };
    if (is_small) {
        visit_each(all);
        return;
    }
    // Blocks aligned to powers of two, whose height ranges chunks store.
    struct Square {
        std::int64_t west, south;
        int log2_side;
    };
    std::array<Square, 32> stack;
    const std::int64_t largest = std::int64_t{1} << kLargest;
    for (std::int64_t south = all.south & -largest; south <= all.north; south += largest) {
        for (std::int64_t west = all.west & -largest; west <= all.east; west += largest) {
            std::size_t count = 0;
            stack[count++] = {west, south, kLargest};
            while (count > 0) {
                const Square square = stack[--count];
                const std::int64_t side = std::int64_t{1} << square.log2_side;
                const CellRange r{std::max(square.west, all.west),
                                  std::max(square.south, all.south),
                                  std::min(square.west + side - 1, all.east),
                                  std::min(square.south + side - 1, all.north)};
                if (r.east < r.west || r.north < r.south) continue;
                const RangeAnswer range = local.square(square.west, square.south, square.log2_side);
                if (range.status == QueryStatus::outside) continue;
                if (range.high != std::numeric_limits<std::int32_t>::max() &&
                    !visitor.wants(local.prism(r, range.low, range.high))) {
                    continue;
                }
                if constexpr (requires { visitor.visit_square(r); }) {
                    if (square.log2_side == kSquare && visitor.visit_square(r)) continue;
                }
                if (square.log2_side <= kSmallest) {
                    if (!visit_each(r)) return;
                    continue;
                }
                const int log2_half = square.log2_side - 1;
                const std::int64_t half = std::int64_t{1} << log2_half;
                stack[count++] = {square.west + half, square.south + half, log2_half};
                stack[count++] = {square.west, square.south + half, log2_half};
                stack[count++] = {square.west + half, square.south, log2_half};
                stack[count++] = {square.west, square.south, log2_half};
            }
        }
    }
}

/// A triangle's plane as a function z(x, y).
struct TrianglePlane {
    explicit TrianglePlane(const Triangle& triangle)
        : a(triangle.v[0]),
          slope_x(-triangle.normal[0] / triangle.normal[2]),
          slope_y(-triangle.normal[1] / triangle.normal[2]) {}
    /// Height of the plane at the x and y of a point, minus the z of the point, metres.
    double above(const Eigen::Vector3d& p) const {
        return slope_x * (p[0] - a[0]) + slope_y * (p[1] - a[1]) - (p[2] - a[2]);
    }
    Eigen::Vector3d a;
    double slope_x;
    double slope_y;
};

/// Twice the signed area of (a, b, p) seen from above: positive if p is to the left of the line from a to b.
inline double left_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                      const Eigen::Vector3d& p) {
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

/// Whether a point lies inside a triangle in plan.
inline bool is_over(const Eigen::Vector3d& p, const Triangle& triangle) {
    return left_of(triangle.v[0], triangle.v[1], p) >= 0.0 &&
           left_of(triangle.v[1], triangle.v[2], p) >= 0.0 &&
           left_of(triangle.v[2], triangle.v[0], p) >= 0.0;
}

/// log2 of the cells along the side of a chunk.
inline constexpr int kChunkLog2 = 7;
static_assert(1 << kChunkLog2 == kChunkCells);

/// Calls visitor(const SolidSurface&, const CellRange& in_chunk) for the volume surface of each chunk that a range of
/// cells overlaps. `in_chunk` is the part of the range in that chunk, counted from the chunk's south-western corner.
template <class Visitor>
void visit_solids(const Ground& ground, const CellRange& cells, Visitor&& visitor) {
    constexpr std::int64_t kLast = kChunkCells - 1;
    for (std::int64_t row = cells.south >> kChunkLog2; row <= cells.north >> kChunkLog2; ++row) {
        for (std::int64_t column = cells.west >> kChunkLog2; column <= cells.east >> kChunkLog2;
             ++column) {
            const std::int64_t west = column << kChunkLog2, south = row << kChunkLog2;
            const SolidSurface* const solid = ground.solid(west, south);
            if (solid == nullptr) continue;
            visitor(*solid, CellRange{std::max(cells.west - west, std::int64_t{0}),
                                      std::max(cells.south - south, std::int64_t{0}),
                                      std::min(cells.east - west, kLast),
                                      std::min(cells.north - south, kLast)});
        }
    }
}

/// Whether a unit direction lies in the ground's normal cone at the feature of a triangle that is farthest along it.
/// The cone of a face is its normal; the cone of an edge or vertex consists of the directions along which no
/// surrounding vertex is farther. At the border of the ground only face normals count, because the sides of the ground
/// are not part of the surface.
bool is_in_normal_cone(const LocalGround& local, const Triangle& triangle,
                       const Eigen::Vector3d& n);

}  // namespace terrane::internal
