// SPDX-License-Identifier: MIT
//
// Sources:
//   J. Amanatides, A. Woo. A Fast Voxel Traversal Algorithm for Ray Tracing. Eurographics 1987.
//   F. K. Musgrave. Grid Tracing: Fast Ray Tracing for Height Fields. 1988. (skipping by intervals)
// Deviations: within a cell the ray's height above the surface is followed as a function of the way:
// linear over each triangle, and continuous from cell to cell. The first change of its sign is the
// hit, so a ray cannot slip through an edge or a corner. Blocks of 8 x 8 cells are skipped by their
// interval of heights.
#include <terrane/terrain/ground.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

constexpr std::int64_t kBlockCells = kChunkCells / kChunkBlocks;

// A ray in a frame whose origin is the south-west corner of the cell that it starts in, in units of
// cells; heights in metres above a base of whole quanta.
struct LocalRay {
    double x, y, z;
    double dx, dy, dz;
    double height(double t) const { return z + dz * t; }
};

// Easternmost and northernmost squares that hold ground: a ray along the closed edge of the extent
// belongs to them.
struct LastSquare {
    std::int64_t column, row;
};

// Calls visit(column, row, enter, leave) for each square of side `size` cells that the ray passes
// within [enter, leave], in order, until it returns true.
template <class Visit>
bool walk(const LocalRay& ray, double enter, double leave, std::int64_t size,
          const LastSquare& last, Visit visit) {
    const auto side = static_cast<double>(size);
    const auto square = [&](double p) { return static_cast<std::int64_t>(std::floor(p / side)); };
    std::int64_t column = std::min(square(ray.x + ray.dx * enter), last.column);
    std::int64_t row = std::min(square(ray.y + ray.dy * enter), last.row);
    const auto crossing = [&](double p, double d, std::int64_t index) {
        if (d == 0.0) return std::numeric_limits<double>::infinity();
        return (static_cast<double>(d > 0.0 ? index + 1 : index) * side - p) / d;
    };
    double t = enter;
    for (;;) {
        const double to_x = crossing(ray.x, ray.dx, column);
        const double to_y = crossing(ray.y, ray.dy, row);
        const double next = std::min(to_x, to_y);
        if (visit(column, row, t, std::clamp(next, t, leave))) return true;
        if (!(next < leave)) return false;
        t = std::max(t, next);
        if (to_x <= to_y) column += ray.dx > 0.0 ? 1 : -1;
        if (to_y <= to_x) row += ray.dy > 0.0 ? 1 : -1;
    }
}

}  // namespace

RayAnswer Ground::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    RayAnswer answer;
    if (!from_world.allFinite() || !to_world.allFinite()) return answer;
    answer.status = GroundStatus::miss;
    const Eigen::Vector3d way = to_world - from_world;

    // only the part over the extent can hit
    double enter = 0.0;
    double leave = 1.0;
    const std::array<double, 2> low{extent().west, extent().south};
    const std::array<double, 2> high{extent().east, extent().north};
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (way[axis] == 0.0) {
            if (from_world[axis] < low[a] || from_world[axis] > high[a]) leave = -1.0;
            continue;
        }
        const double t0 = (low[a] - from_world[axis]) / way[axis];
        const double t1 = (high[a] - from_world[axis]) / way[axis];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
    }
    if (enter > leave) return answer;

    // in the frame of the cell where it comes over the extent
    const WorldPos start = from_world + enter * way;
    const std::int64_t column0 = column_at(start.x());
    const std::int64_t row0 = row_at(start.y());
    const double quantum = lattice().quantum;
    const double base = quantum * std::floor(start.z() / quantum);
    const LocalRay ray{(start.x() - cell_x(column0)) / spacing_,
                       (start.y() - cell_y(row0)) / spacing_,
                       start.z() - base,
                       way.x() / spacing_,
                       way.y() / spacing_,
                       way.z()};
    const double length = leave - enter;
    const auto above_base = [&](std::int32_t height) {
        return quantum * static_cast<double>(height) - base;
    };

    GroundReader reader(*this);
    int side = 0;  // of the surface that the ray is on: 1 above, -1 below, 0 not known
    const auto hit_at = [&](double t, double slope_x, double slope_y, const GroundCell& cell) {
        answer.status = GroundStatus::ok;
        answer.fraction = std::clamp(enter + t, 0.0, 1.0);
        answer.point_world = from_world + answer.fraction * way;
        const Eigen::Vector3d up(-slope_x / spacing_, -slope_y / spacing_, 1.0);
        answer.normal = up / up.norm();
        answer.error_m = static_cast<double>(cell.error_m);
        answer.filled = cell.filled;
        return true;
    };

    const auto visit_cell = [&](std::int64_t column, std::int64_t row, double t0, double t1) {
        GroundCell cell = reader.cell(column0 + column, row0 + row);
        // cells are closed: a ray along a line may find ground on the other side of it only
        if (cell.status == GroundStatus::outside && ray.dx == 0.0 &&
            ray.x == static_cast<double>(column)) {
            cell = reader.cell(column0 + column - 1, row0 + row);
            if (cell.status == GroundStatus::ok) --column;
        }
        if (cell.status == GroundStatus::outside && ray.dy == 0.0 &&
            ray.y == static_cast<double>(row)) {
            cell = reader.cell(column0 + column, row0 + row - 1);
            if (cell.status == GroundStatus::ok) --row;
        }
        if (cell.status == GroundStatus::outside) {
            side = 0;
            return false;
        }
        if (cell.status == GroundStatus::not_resident) {
            answer.status = GroundStatus::not_resident;
            return true;
        }
        // each triangle continues a plane: z = z0 + slope_x u + slope_y v
        const double south_west = above_base(cell.south_west);
        const double south_east = above_base(cell.south_east);
        const double north_west = above_base(cell.north_west);
        const double north_east = above_base(cell.north_east);
        struct Plane {
            double z0, slope_x, slope_y;
        };
        // the triangles on the south-eastern or south-western, and on the other, side of the cut
        const Plane first =
            cell.cut_to_north_east
                ? Plane{south_west, south_east - south_west, north_east - south_east}
                : Plane{south_west, south_east - south_west, north_west - south_west};
        const Plane second =
            cell.cut_to_north_east
                ? Plane{south_west, north_east - north_west, north_west - south_west}
                : Plane{north_west + south_east - north_east, north_east - north_west,
                        north_east - south_east};
        const auto u = [&](double t) { return ray.x + ray.dx * t - static_cast<double>(column); };
        const auto v = [&](double t) { return ray.y + ray.dy * t - static_cast<double>(row); };
        // > 0 over the first triangle
        const auto over_first = [&](double t) {
            return cell.cut_to_north_east ? u(t) - v(t) : 1.0 - u(t) - v(t);
        };
        const auto clearance = [&](const Plane& plane, double t) {
            return ray.height(t) - (plane.z0 + plane.slope_x * u(t) + plane.slope_y * v(t));
        };
        const double cut0 = over_first(t0);
        const double cut1 = over_first(t1);
        const bool crosses = (cut0 > 0.0) != (cut1 > 0.0) && cut0 != cut1;
        const double middle =
            crosses ? std::clamp(t0 + (t1 - t0) * (cut0 / (cut0 - cut1)), t0, t1) : t1;
        for (int part = 0; part < (crosses ? 2 : 1); ++part) {
            const double begin = part == 0 ? t0 : middle;
            const double end = part == 0 ? middle : t1;
            const bool is_first = crosses ? (cut0 > 0.0) == (part == 0) : cut0 + cut1 > 0.0;
            const Plane& plane = is_first ? first : second;
            const double clear0 = clearance(plane, begin);
            const double clear1 = clearance(plane, end);
            const int side0 = (clear0 > 0.0) - (clear0 < 0.0);
            if (side0 == 0 || side * side0 < 0) {
                return hit_at(begin, plane.slope_x, plane.slope_y, cell);
            }
            const int side1 = (clear1 > 0.0) - (clear1 < 0.0);
            if (side1 != side0) {
                const double t = begin + (end - begin) * (clear0 / (clear0 - clear1));
                return hit_at(t, plane.slope_x, plane.slope_y, cell);
            }
            side = side1;
        }
        return false;
    };

    const LastSquare last_cell{in_extent_.east - column0, in_extent_.north - row0};
    const std::int64_t block_column0 = column0 & ~(kBlockCells - 1);
    const std::int64_t block_row0 = row0 & ~(kBlockCells - 1);
    const std::int64_t shift_x = column0 - block_column0;
    const std::int64_t shift_y = row0 - block_row0;
    LocalRay block_ray = ray;
    block_ray.x += static_cast<double>(shift_x);
    block_ray.y += static_cast<double>(shift_y);
    const LastSquare last_block{(last_cell.column + shift_x) >> 3, (last_cell.row + shift_y) >> 3};
    static_assert(kBlockCells == 1 << 3);
    walk(block_ray, 0.0, length, kBlockCells, last_block,
         [&](std::int64_t block_column, std::int64_t block_row, double t0, double t1) {
             const std::int64_t west = block_column0 + block_column * kBlockCells;
             const std::int64_t south = block_row0 + block_row * kBlockCells;
             // one cell more on each side, since a rounded crossing may be a hair off
             const RangeAnswer heights = reader.block(west, south);
             if (heights.status == GroundStatus::ok) {
                 const double lowest = std::min(ray.height(t0), ray.height(t1));
                 const double highest = std::max(ray.height(t0), ray.height(t1));
                 if (lowest > above_base(heights.high)) {
                     side = 1;
                     return false;
                 }
                 if (highest < above_base(heights.low)) {
                     side = -1;
                     return false;
                 }
             } else if (heights.status == GroundStatus::outside) {
                 side = 0;
                 return false;
             }
             return walk(ray, t0, t1, 1, last_cell,
                         [&](std::int64_t column, std::int64_t row, double a, double b) {
                             return visit_cell(column, row, a, b);
                         });
         });
    return answer;
}

}  // namespace terrane
