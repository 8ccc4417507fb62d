// SPDX-License-Identifier: MIT
#include "ground/ray_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane {
namespace {

// False for NaN.
bool is_place(const WorldPos& point_world) {
    return std::abs(point_world.x()) <= kFarthestPlace &&
           std::abs(point_world.y()) <= kFarthestPlace &&
           std::abs(point_world.z()) <= kFarthestPlace;
}

}  // namespace

RayAnswer Ground::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    return ray_after(0.0, from_world, to_world);
}

RayAnswer Ground::ray_after(double fraction, const WorldPos& from_world,
                            const WorldPos& to_world) const {
    RayAnswer answer;
    if (!is_place(from_world) || !is_place(to_world)) return answer;
    const Eigen::Vector3d displacement = to_world - from_world;
    answer.status = QueryStatus::miss;

    // clip to the extent, beyond which there is no ground
    double enter = 0.0;
    double leave = 1.0;
    WorldPos start = from_world;
    if (!extent_.contains(from_world.x(), from_world.y()) ||
        !extent_.contains(to_world.x(), to_world.y())) {
        const std::array<double, 2> low{extent_.west, extent_.south};
        const std::array<double, 2> high{extent_.east, extent_.north};
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            if (displacement[axis] == 0.0) {
                if (from_world[axis] < low[a] || from_world[axis] > high[a]) leave = -1.0;
                continue;
            }
            const double t0 = (low[a] - from_world[axis]) / displacement[axis];
            const double t1 = (high[a] - from_world[axis]) / displacement[axis];
            enter = std::max(enter, std::min(t0, t1));
            leave = std::min(leave, std::max(t0, t1));
        }
        if (enter > leave) return answer;
        start = from_world + enter * displacement;
        start.x() = std::clamp(start.x(), extent_.west, extent_.east);
        start.y() = std::clamp(start.y(), extent_.south, extent_.north);
    }

    const bool is_above = fraction > enter;
    if (is_above && fraction >= leave) return answer;
    RayWalk ray(*this, start, displacement, is_above);
    ray.walk(is_above ? fraction - enter : 0.0, leave - enter);
    ray.answer(answer);
    if (answer.status != QueryStatus::ok) return answer;
    answer.fraction = std::clamp(enter + ray.t(), 0.0, 1.0);
    answer.point_world = from_world + answer.fraction * displacement;
    return answer;
}

// Sources:
//   J. Amanatides, A. Woo. A Fast Voxel Traversal Algorithm for Ray Tracing. Eurographics 1987. (steps between cells)
//   F. K. Musgrave. Grid Tracing: Fast Ray Tracing for Height Fields. 1988. (skipping by height intervals)
//   A. Tevs, I. Ihrke, H.-P. Seidel. Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field Rendering.
//     I3D 2008. (a pyramid of height intervals)
// Deviations: within a cell the ray's height above the surface is evaluated as a function of the ray parameter, linear
//             over each triangle and continuous across cells. The hit is the first change of its sign, so a ray cannot
//             slip through an edge or a corner. A square is skipped if the ray stays above or below its height
//             interval, but never if that would change the side of the surface on which the ray is.

namespace {

/// Relative rounding of a ray's parameter at a border; generous, for triangles nearly parallel to the ray.
constexpr double kSpanSlack = 1e-13;

/// cell_index() of a cell in its chunk.
std::size_t index_in_chunk(std::int64_t column, std::int64_t row) {
    return cell_index(static_cast<int>(column & (kChunkCells - 1)),
                      static_cast<int>(row & (kChunkCells - 1)));
}

}  // namespace

void Ground::RayWalk::walk(double begin, double leave) {
    // start with the smallest square that contains both ends
    const CellRange& extent = ground_.in_extent_;
    const auto ends = [&](const RayAxis& axis, std::int64_t low, std::int64_t high) {
        return std::array{std::clamp(axis.cell(begin), low, high),
                          std::clamp(axis.cell(leave), low, high)};
    };
    const auto columns = ends(x_, extent.west, extent.east);
    const auto rows = ends(y_, extent.south, extent.north);
    const std::int64_t differing = (columns[0] ^ columns[1]) | (rows[0] ^ rows[1]);
    if (differing >> kChunkShift != 0) {
        visit_squares<kChunkShift>(extent, begin, leave, [this](const SquareSpan& over) {
            is_whole_ = false;
            const CellRange cells = cells_of(over, kChunkCells);
            if (cells.west > cells.east || cells.south > cells.north) {
                side_ = 0;
                return false;
            }
            if (open_chunk(over.column, over.row)) return true;
            if (chunk_->solid != nullptr) return visit_solid_chunk(over);
            return !clears({chunk_->low, chunk_->high}, over) && visit_parts<kChunkShift>(over);
        });
        return;
    }
    if (open_chunk(columns[0], rows[0])) return;
    SquareSpan over{columns[0], rows[0], begin, leave};
    if (chunk_->solid != nullptr) {
        over.column &= -kChunkCells;
        over.row &= -kChunkCells;
        visit_solid_chunk(over);
        return;
    }
    if (differing == 0) {
        is_whole_ ? intersect_cell(over) : visit_partial_cell(over);
        return;
    }
    const int log2_side = differing >> kSmall == 0   ? kSmall
                          : differing >> kLarge == 0 ? kLarge
                                                     : kChunkShift;
    const std::int64_t side = std::int64_t{1} << log2_side;
    over.column &= -side;
    over.row &= -side;
    // clamp to the square against rounding
    over.end = std::min({leave, x_.crossing(x_.offset(over.column + (x_.sign > 0 ? side : 0))),
                         y_.crossing(y_.offset(over.row + (y_.sign > 0 ? side : 0)))});
    if (log2_side == kSmall) {
        visit_parts<kSmall>(over);
    } else if (log2_side == kLarge) {
        visit_parts<kLarge>(over);
    } else {
        visit_parts<kChunkShift>(over);
    }
}

// Returns true if the chunk is not resident, which ends the ray.
bool Ground::RayWalk::open_chunk(std::int64_t column, std::int64_t row) {
    chunk_ = ground_.find_chunk(column, row);
    if (chunk_ == nullptr) {
        status_ = QueryStatus::not_resident;
        return true;
    }
    const CellRange& extent = ground_.in_extent_;
    const std::int64_t west = column & -kChunkCells, south = row & -kChunkCells;
    is_whole_ = chunk_->cell_flags.empty() && west >= extent.west && south >= extent.south &&
                west + kChunkCells - 1 <= extent.east && south + kChunkCells - 1 <= extent.north;
    return false;
}

// Finds the first hit in a chunk with a joined solid, on one of its triangles or on a cell. Cells are not skipped by
// height, because the ray may pass through replaced triangles and change its side.
bool Ground::RayWalk::visit_solid_chunk(const SquareSpan& over) {
    // extends the interval slightly beyond both borders of the chunk, where the t of triangles rounds differently
    const double slack =
        kSpanSlack * (1.0 + start_world_.cwiseAbs().maxCoeff() / displacement_.norm());
    std::optional<SolidSurface::Hit> met =
        chunk_->solid->ray(start_world_, displacement_, over.begin - slack, over.end + slack);
    if (met) met->t = std::clamp(met->t, over.begin, std::max(over.begin, over.end));
    const CellRange cells = cells_of(over, kChunkCells);
    bool is_hit = false;
    visit_squares<0>(cells, over.begin, over.end, [&](const SquareSpan& part) {
        if (met && part.begin > met->t) return true;
        is_hit = is_whole_ ? intersect_cell(part) : visit_partial_cell(part);
        return is_hit;
    });
    if (is_hit && (status_ != QueryStatus::ok || !met || t_ <= met->t)) return true;
    if (!met) return false;
    status_ = QueryStatus::ok;
    t_ = met->t;
    solid_triangle_ = met->triangle;
    // A clipped triangle has the error of its cell.
    const std::int64_t column = std::clamp(x_.cell(t_), cells.west, cells.east);
    const std::int64_t row = std::clamp(y_.cell(t_), cells.south, cells.north);
    error_m_ = std::max(chunk_->solid->error_m(met->triangle),
                        static_cast<double>(chunk_->cell_error(index_in_chunk(column, row))));
    is_filled_ = false;
    return true;
}

// Intersects a cell that may lie beyond the extent or not be ground.
bool Ground::RayWalk::visit_partial_cell(const SquareSpan& over) {
    GroundReader reader(ground_);
    std::int64_t column = over.column, row = over.row;
    GroundCell cell = reader.cell(column, row);
    // cells are closed: for a ray along a line, only the cell on the other side of the line may be ground
    if (cell.status == QueryStatus::outside && x_.d == 0.0 && x_.p == x_.offset(column)) {
        cell = reader.cell(column - 1, row);
        if (cell.status == QueryStatus::ok) --column;
    }
    if (cell.status == QueryStatus::outside && y_.d == 0.0 && y_.p == y_.offset(row)) {
        cell = reader.cell(column, row - 1);
        if (cell.status == QueryStatus::ok) --row;
    }
    if (cell.status == QueryStatus::outside) {
        side_ = 0;
        return false;
    }
    if (cell.status == QueryStatus::not_resident) {
        status_ = QueryStatus::not_resident;
        return true;
    }
    return intersect(*ground_.find_chunk(column, row), column, row, over);
}

bool Ground::RayWalk::intersect(const Chunk& chunk, std::int64_t column, std::int64_t row,
                                const SquareSpan& over) {
    const GroundCell cell = read_cell(chunk, column, row);
    const double south_west = above_base(cell.south_west);
    const double south_east = above_base(cell.south_east);
    const double north_west = above_base(cell.north_west);
    const double north_east = above_base(cell.north_east);
    // the triangles south and north of the diagonal
    const Plane first = cell.cut_to_north_east
                            ? Plane{south_west, south_east - south_west, north_east - south_east}
                            : Plane{south_west, south_east - south_west, north_west - south_west};
    const Plane second = cell.cut_to_north_east
                             ? Plane{south_west, north_east - north_west, north_west - south_west}
                             : Plane{north_west + south_east - north_east, north_east - north_west,
                                     north_east - south_east};
    const double west = x_.offset(column), south = y_.offset(row);
    const auto u = [&](double t) { return x_.at(t) - west; };
    const auto v = [&](double t) { return y_.at(t) - south; };
    // > 0 over the first triangle
    const auto over_first = [&](double t) {
        return cell.cut_to_north_east ? u(t) - v(t) : 1.0 - u(t) - v(t);
    };
    const auto clearance = [&](const Plane& plane, double t) {
        return height(t) - (plane.z0 + plane.slope_x * u(t) + plane.slope_y * v(t));
    };
    const double t0 = over.begin, t1 = std::max(over.begin, over.end);
    const double cut0 = over_first(t0);
    const double cut1 = over_first(t1);
    const bool crosses = (cut0 > 0.0) != (cut1 > 0.0) && cut0 != cut1;
    const double middle =
        crosses ? std::clamp(t0 + (t1 - t0) * (cut0 / (cut0 - cut1)), t0, t1) : t1;
    for (int part = 0; part < (crosses ? 2 : 1); ++part) {
        const double begin = part == 0 ? t0 : middle;
        const double end = part == 0 ? middle : t1;
        const bool is_first = crosses ? (cut0 > 0.0) == (part == 0) : cut0 + cut1 > 0.0;
        if (chunk.solid != nullptr &&
            chunk.solid->is_replaced(index_in_chunk(column, row), !is_first)) {
            side_ = 0;
            continue;
        }
        const Plane& plane = is_first ? first : second;
        const double clear0 = clearance(plane, begin);
        const double clear1 = clearance(plane, end);
        const int side0 = (clear0 > 0.0) - (clear0 < 0.0);
        if (side0 == 0 || side_ * side0 < 0) return record_hit(begin, plane, cell);
        const int side1 = (clear1 > 0.0) - (clear1 < 0.0);
        if (side1 != side0) {
            return record_hit(begin + (end - begin) * (clear0 / (clear0 - clear1)), plane, cell);
        }
        side_ = side1;
    }
    return false;
}

bool Ground::RayWalk::record_hit(double t, const Plane& plane, const GroundCell& cell) {
    status_ = QueryStatus::ok;
    t_ = t;
    slope_x_ = plane.slope_x;
    slope_y_ = plane.slope_y;
    error_m_ = static_cast<double>(cell.error_m);
    is_filled_ = cell.filled;
    return true;
}

void Ground::RayWalk::answer(RayAnswer& answer_out) const {
    answer_out.status = status_;
    if (status_ != QueryStatus::ok) return;
    if (solid_triangle_) {
        answer_out.normal = chunk_->solid->normal(*solid_triangle_);
        answer_out.error_m = error_m_;
        return;
    }
    const double spacing = ground_.spacing_, quantum = ground_.quantum_;
    const Eigen::Vector3d up(-quantum * slope_x_ / spacing, -quantum * slope_y_ / spacing, 1.0);
    answer_out.normal = up / up.norm();
    answer_out.error_m = error_m_;
    answer_out.filled = is_filled_;
}

}  // namespace terrane
