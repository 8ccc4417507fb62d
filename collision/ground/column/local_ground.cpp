// SPDX-License-Identifier: MIT
#include "ground/column/local_ground.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {

bool LocalWindow::is_ground(const CellRange& range) const {
    const auto width = static_cast<int>(range.east - range.west) + 1;
    const std::uint32_t all = ((std::uint32_t{1} << width) - 1u) << (range.west - cells.west);
    std::uint32_t bits = all;
    for (std::int64_t row = range.south; row <= range.north; ++row) {
        bits &= ground[static_cast<std::size_t>(row - cells.south)];
    }
    return bits == all;
}

bool LocalWindow::read(GroundReader& reader, const CellRange& range, std::int64_t base,
                       double quantum) {
    cells = {};
    if (range.east < range.west || range.north < range.south ||
        range.east - range.west >= kMostCells || range.north - range.south >= kMostCells) {
        return false;
    }
    columns = static_cast<int>(range.east - range.west) + 1;
    rows = static_cast<int>(range.north - range.south) + 1;
    is_odd = ((range.west + range.south) & 1) != 0;
    std::array<std::int32_t, static_cast<std::size_t>(kStride) * kStride> quanta;
    reader.heights(range, kStride, quanta, ground);
    cells = range;
    is_full = is_ground(range);
    std::int32_t highest = quanta[0];
    for (int row = 0; row <= rows; ++row) {
        const std::size_t first = static_cast<std::size_t>(row) * kStride;
        for (std::size_t i = first; i <= first + static_cast<std::size_t>(columns); ++i) {
            highest = std::max(highest, quanta[i]);
            z[i] = quantum * static_cast<double>(quanta[i] - base);
        }
    }
    high = quantum * static_cast<double>(highest - base);
    return true;
}

LocalGround::LocalGround(const Ground& ground, const WorldPos& near_world)
    : reader_(ground),
      spacing_(ground.spacing()),
      inverse_spacing_(1.0 / ground.spacing()),
      quantum_(ground.lattice().quantum) {
    // Clamped to the extent, within which lattice indices do not overflow.
    const WorldRect& extent = ground.extent();
    column_ = ground.column_at(std::clamp(near_world.x(), extent.west, extent.east));
    row_ = ground.row_at(std::clamp(near_world.y(), extent.south, extent.north));
    base_ = static_cast<std::int64_t>(
        std::floor(std::clamp(near_world.z() / quantum_, -0x1p52, 0x1p52)));
    set_origin();
}

LocalGround::LocalGround(const LocalGround& other, const Eigen::Vector3d& near)
    : reader_(other.reader_),
      spacing_(other.spacing_),
      inverse_spacing_(other.inverse_spacing_),
      quantum_(other.quantum_),
      column_(other.column_),
      row_(other.row_),
      base_(other.base_) {
    // No cell or height is this many steps away.
    constexpr double kFar = 0x1p40;
    const auto steps = [&](double p, double step) {
        return static_cast<std::int64_t>(std::floor(std::clamp(p / step, -kFar, kFar)));
    };
    column_ += steps(near[0], spacing_);
    row_ += steps(near[1], spacing_);
    base_ += steps(near[2], quantum_);
    set_origin();
}

void LocalGround::set_origin() {
    origin_world_ = {ground().cell_x(column_), ground().cell_y(row_),
                     quantum_ * static_cast<double>(base_)};
}

CellRange LocalGround::cells(double west, double south, double east, double north) const {
    const WorldRect& extent = ground().extent();
    const double limit_west = extent.west - origin_world_.x() - spacing_;
    const double limit_east = extent.east - origin_world_.x() + spacing_;
    const double limit_south = extent.south - origin_world_.y() - spacing_;
    const double limit_north = extent.north - origin_world_.y() + spacing_;
    CellRange none;
    if (!(west <= limit_east && east >= limit_west && south <= limit_north &&
          north >= limit_south)) {
        return none;
    }
    // A rectangle with its western side on a lattice line also touches the cells to the west.
    const auto first = [this](double p) {
        return static_cast<std::int64_t>(std::ceil(p / spacing_)) - 1;
    };
    const auto last = [this](double p) {
        return static_cast<std::int64_t>(std::floor(p / spacing_));
    };
    return {column_ + first(std::max(west, limit_west)), row_ + first(std::max(south, limit_south)),
            column_ + last(std::min(east, limit_east)), row_ + last(std::min(north, limit_north))};
}

CellPrism LocalGround::prism(const CellRange& cells, std::int32_t low, std::int32_t high) const {
    return {x(cells.west), y(cells.south), x(cells.east + 1), y(cells.north + 1), z(high), z(low)};
}

const LocalWindow* LocalGround::window(const CellRange& cells, int ring) const {
    if (cells.east < cells.west || cells.north < cells.south) return nullptr;
    if (!ground().is_within_extent(cells)) return nullptr;
    const auto widened = [&](int by) {
        return CellRange{cells.west - by, cells.south - by, cells.east + by, cells.north + by};
    };
    // Reads one more cell on each side even if `ring` is 0, because the next query may need it.
    if (!window_.holds(widened(ring)) && !window_.read(reader_, widened(1), base_, quantum_)) {
        return nullptr;
    }
    return window_.is_full || window_.is_ground(cells) ? &window_ : nullptr;
}

double LocalGround::error(const CellRange& cells) const {
    if (!(cells == error_cells_)) {
        error_ = static_cast<double>(reader_.error(cells));
        error_cells_ = cells;
    }
    return error_;
}

bool LocalGround::find_vertex(std::int64_t column, std::int64_t row, Eigen::Vector3d& p_out) const {
    if (window_.is_full && window_.holds({column - 1, row - 1, column, row})) {
        p_out = {x(column), y(row),
                 window_.at(static_cast<int>(column - window_.cells.west),
                            static_cast<int>(row - window_.cells.south))};
        return true;
    }
    for (int k = 0; k < 4; ++k) {
        const bool is_east = (k & 1) != 0;  // the vertex is on the cell's eastern side
        const bool is_north = (k & 2) != 0;
        const GroundCell found = cell(column - (is_east ? 1 : 0), row - (is_north ? 1 : 0));
        if (found.status != QueryStatus::ok) continue;
        const std::int32_t height = is_north ? (is_east ? found.north_east : found.north_west)
                                             : (is_east ? found.south_east : found.south_west);
        p_out = {x(column), y(row), z(height)};
        return true;
    }
    return false;
}

std::array<Eigen::Vector3d, 3> LocalGround::corners(const LocalWindow& window, int column, int row,
                                                    bool is_south) const {
    const auto at = [&](int i, int j) { return vertex(window, i, j); };
    // The two ends of the diagonal and the corner on the chosen side.
    if (window.is_cut_to_north_east(column, row)) {
        const Eigen::Vector3d from = at(column, row), to = at(column + 1, row + 1);
        if (is_south) return {from, at(column + 1, row), to};
        return {from, to, at(column, row + 1)};
    }
    const Eigen::Vector3d from = at(column + 1, row), to = at(column, row + 1);
    if (is_south) return {at(column, row), from, to};
    return {from, at(column + 1, row + 1), to};
}

namespace {

/// A convex polygon over part of a triangle.
struct CutPolygon {
    static constexpr std::size_t kMost = 7;  ///< corners of a triangle clipped by four edges
    std::array<Eigen::Vector3d, kMost> v;
    std::size_t count = 0;

    /// Adds a corner, unless it coincides with the last one.
    void add(const Eigen::Vector3d& p, double least) {
        const auto is_near = [&](const Eigen::Vector3d& other) {
            return std::abs(p[0] - other[0]) + std::abs(p[1] - other[1]) <= least;
        };
        if (count == 0 || (!is_near(v[count - 1]) && !is_near(v[0]))) v[count++] = p;
    }
};

/// The part of a polygon in which `sign` times a coordinate is at most `sign * limit`. Cells that share an edge get the
/// same point on it.
CutPolygon cut(const CutPolygon& polygon, Eigen::Index axis, double limit, double sign,
               double least) {
    CutPolygon inside;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        const Eigen::Vector3d& from = polygon.v[i];
        const Eigen::Vector3d& to = polygon.v[(i + 1) % polygon.count];
        const bool is_from_inside = sign * (from[axis] - limit) <= 0.0;
        if (is_from_inside) inside.add(from, least);
        if (is_from_inside == (sign * (to[axis] - limit) <= 0.0)) continue;
        const bool is_ordered = from[0] < to[0] || (from[0] == to[0] && from[1] < to[1]);
        const Eigen::Vector3d& a = is_ordered ? from : to;
        const Eigen::Vector3d& b = is_ordered ? to : from;
        Eigen::Vector3d p = a + (limit - a[axis]) / (b[axis] - a[axis]) * (b - a);
        p[axis] = limit;
        inside.add(p, least);
    }
    return inside;
}

}  // namespace

CellTriangles LocalGround::triangles(const GroundCell& cell, std::int64_t column,
                                     std::int64_t row) const {
    const std::array<Triangle, 2> both = whole_triangles(cell, column, row);
    CellTriangles all;
    if (is_whole(column, row)) {
        all.triangles[0] = both[0];
        all.triangles[1] = both[1];
        all.count = 2;
        all.south_count = 1;
        return all;
    }
    const WorldRect& extent = ground().extent();
    const double least = 1e-9 * spacing_;
    for (const Triangle& whole : both) {
        CutPolygon part;
        for (const Eigen::Vector3d& corner : whole.v) part.add(corner, least);
        part = cut(part, 0, extent.west - origin_world_.x(), -1.0, least);
        part = cut(part, 0, extent.east - origin_world_.x(), 1.0, least);
        part = cut(part, 1, extent.south - origin_world_.y(), -1.0, least);
        part = cut(part, 1, extent.north - origin_world_.y(), 1.0, least);
        for (std::size_t i = 2; i < part.count; ++i) {
            const Triangle piece{{part.v[0], part.v[i - 1], part.v[i]}, whole.normal};
            if (left_of(piece.v[0], piece.v[1], piece.v[2]) > least * spacing_) {
                all.triangles[all.count++] = piece;
            }
        }
        if (&whole == both.data()) all.south_count = all.count;
    }
    return all;
}

std::array<std::int64_t, 2> LocalGround::cell_of(const Triangle& triangle) const {
    const Eigen::Vector3d middle = (triangle.v[0] + triangle.v[1] + triangle.v[2]) / 3.0;
    return {column_ + static_cast<std::int64_t>(std::floor(middle[0] / spacing_)),
            row_ + static_cast<std::int64_t>(std::floor(middle[1] / spacing_))};
}

std::array<Triangle, 2> LocalGround::whole_triangles(const GroundCell& cell, std::int64_t column,
                                                     std::int64_t row) const {
    const double west = x(column);
    const double east = x(column + 1);
    const double south = y(row);
    const double north = y(row + 1);
    const Eigen::Vector3d sw(west, south, z(cell.south_west));
    const Eigen::Vector3d se(east, south, z(cell.south_east));
    const Eigen::Vector3d nw(west, north, z(cell.north_west));
    const Eigen::Vector3d ne(east, north, z(cell.north_east));
    if (cell.cut_to_north_east) return {make_triangle(sw, se, ne), make_triangle(sw, ne, nw)};
    return {make_triangle(sw, se, nw), make_triangle(se, ne, nw)};
}

namespace {

struct LatticeIndex {
    std::int64_t column = 0;
    std::int64_t row = 0;
};

}  // namespace

bool is_in_normal_cone(const LocalGround& local, const Triangle& triangle,
                       const Eigen::Vector3d& n) {
    // A neighbour counts as higher along n if it exceeds `point` by more than this, metres.
    const double slack = 1e-10 * local.spacing();
    std::array<LatticeIndex, 3> top;
    std::size_t count = 0;
    const auto [column, row] = local.cell_of(triangle);
    const GroundCell cell = local.is_whole(column, row) ? GroundCell() : local.cell(column, row);
    std::array<Eigen::Vector3d, 3> corners = triangle.v;
    if (cell.status == QueryStatus::ok) {
        // A feature of a clipped triangle is one of the whole triangle, or it lies on an edge of the extent.
        const std::array<Triangle, 2> both = local.whole_triangles(cell, column, row);
        const Eigen::Vector3d middle = (triangle.v[0] + triangle.v[1] + triangle.v[2]) / 3.0;
        corners = both[is_over(middle, both[0]) ? 0 : 1].v;
        const auto farthest = [&](const std::array<Eigen::Vector3d, 3>& v) {
            return std::max({dot(n, v[0] - middle), dot(n, v[1] - middle), dot(n, v[2] - middle)});
        };
        if (farthest(triangle.v) < farthest(corners) - slack) return false;
    }
    const Eigen::Vector3d& a = corners[0];
    const double highest = std::max({0.0, dot(n, corners[1] - a), dot(n, corners[2] - a)});
    Eigen::Vector3d point = a;
    for (const Eigen::Vector3d& v : corners) {
        if (dot(n, v - a) < highest - slack) continue;
        point = v;
        top[count++] = {local.column_of(v[0]), local.row_of(v[1])};
    }
    if (count == 3) return true;
    const auto is_below = [&](const LatticeIndex& at) {
        Eigen::Vector3d p;
        return local.find_vertex(at.column, at.row, p) && dot(n, p - point) <= slack;
    };
    if (count == 2) {
        const std::int64_t dx = top[1].column - top[0].column;
        const std::int64_t dy = top[1].row - top[0].row;
        if (dx != 0 && dy != 0) {  // the diagonal of a cell
            return is_below({top[0].column + dx, top[0].row}) &&
                   is_below({top[0].column, top[0].row + dy});
        }
        // A side between two cells. Its triangles' third corners are the neighbours, across the side, of its odd end.
        const bool first_is_odd = ((top[0].column + top[0].row) & 1) != 0;
        const LatticeIndex odd = first_is_odd ? top[0] : top[1];
        const LatticeIndex low{std::min(top[0].column, top[1].column),
                               std::min(top[0].row, top[1].row)};
        const std::int64_t across_x = dx == 0 ? 1 : 0;
        const std::int64_t across_y = dy == 0 ? 1 : 0;
        return local.is_ground(low.column, low.row) &&
               local.is_ground(low.column - across_x, low.row - across_y) &&
               is_below({odd.column + across_x, odd.row + across_y}) &&
               is_below({odd.column - across_x, odd.row - across_y});
    }
    const LatticeIndex at = top[0];
    const bool is_even = ((at.column + at.row) & 1) == 0;
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dx = -1; dx <= 1; ++dx) {
            if ((dx == 0 && dy == 0) || (dx != 0 && dy != 0 && !is_even)) continue;
            if (!is_below({at.column + dx, at.row + dy})) return false;
        }
    }
    return local.is_ground(at.column, at.row) && local.is_ground(at.column - 1, at.row) &&
           local.is_ground(at.column, at.row - 1) && local.is_ground(at.column - 1, at.row - 1);
}

}  // namespace terrane::internal
